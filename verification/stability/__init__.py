"""Stability of sampled contact (C20, C21): a mass on a wall with exact physics between the samples, the peg of the
engine, and how hard a wall feels. Plain records, no files written."""
