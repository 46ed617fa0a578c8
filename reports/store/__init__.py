"""Runs and tables on disk: HDF5 files that are either complete or absent, and are found by the hash of their inputs."""

from reports.store.folder import RunStore
from reports.store.keys import content_hash, run_key
from reports.store.runs import RunEntry, read_provenance, read_run, write_run
from reports.store.tables import Column, Table, read_table, read_tables, write_table, write_tables

__all__ = [
    "Column",
    "RunEntry",
    "RunStore",
    "Table",
    "content_hash",
    "read_provenance",
    "read_run",
    "read_table",
    "read_tables",
    "run_key",
    "write_run",
    "write_table",
    "write_tables",
]
