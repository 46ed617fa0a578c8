"""Studies of the mechanics: plain records, no files written."""
