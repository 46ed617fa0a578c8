"""Runs on disk, figures, the report and the command line."""
