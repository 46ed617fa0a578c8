"""Studies: questions that a table of runs or impacts answers. Plain records; nothing is written."""
