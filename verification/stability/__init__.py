"""Stability of sampled contact (C20, C21): a mass at a wall with exact motion between the samples,
the peg in the engine, and the rate-hardness of a wall. The studies return plain records and write
no files."""
