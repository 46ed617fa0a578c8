"""Runs and tables on disk: HDF5 files that are either complete or absent, and are found by the hash
of their inputs.

Each name is loaded at its first use: a run loads nothing of the verification.
"""

from iapb.lazy import lazy_names

_HOME = {
    "RunStore": ".folder",
    "content_hash": ".keys",
    "run_key": ".keys",
    "RunEntry": ".runs",
    "read_provenance": ".runs",
    "read_run": ".runs",
    "write_run": ".runs",
}

__getattr__, __dir__, __all__ = lazy_names(__name__, _HOME)
