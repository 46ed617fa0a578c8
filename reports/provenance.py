"""Where a result comes from: code, packages, processor, command; no machine path and no host name."""

from __future__ import annotations

import hashlib
import platform
import shlex
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_ROOT = Path(__file__).resolve().parent.parent
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "h5py")
UNKNOWN = "unknown"


def collect_provenance(
    seeds: Sequence[int] = (), command: str | None = None, threads: int | None = None
) -> dict[str, str]:
    """Return what it takes to make a result again, as texts by name.

    Parameters
    ----------
    seeds
        Seeds of the random numbers used, if any.
    command
        The command that makes it again; by default the one that runs now, without machine paths.
    threads
        Threads that took part; by default not stated.
    """
    facts = dict(_facts())
    facts["seeds"] = ", ".join(str(seed) for seed in seeds) or "none"
    facts["command"] = current_command() if command is None else command
    if threads is not None:
        facts["threads"] = str(threads)
    return facts


def current_command() -> str:
    """Return the command line of this process; absolute paths are cut to their last part."""
    words = [Path(word).name if Path(word).is_absolute() else word for word in sys.argv]
    return shlex.join([Path(words[0]).name or "python", *words[1:]])


@cache
def _facts() -> tuple[tuple[str, str], ...]:
    """What does not change while the process lives."""
    facts = {
        "version": package_version("iapb"),
        "commit": _git("rev-parse", "HEAD") or UNKNOWN,
        "dirty": _dirty(),
        "lock": lock_hash(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "system": f"{platform.system()} {platform.machine()}",
        "cpu": processor(),
        "blas": linear_algebra(),
    }
    facts.update({package: package_version(package) for package in _PACKAGES})
    return tuple(facts.items())


def package_version(package: str) -> str:
    """Return the version of an installed package, or ``unknown``."""
    try:
        return version(package)
    except PackageNotFoundError:
        return UNKNOWN


def lock_hash() -> str:
    """Return sha256 of requirements.lock, or ``unknown`` outside a checkout."""
    lock = _ROOT / "requirements.lock"
    return hashlib.sha256(lock.read_bytes()).hexdigest() if lock.is_file() else UNKNOWN


def processor() -> str:
    """Return the processor's model name."""
    table = Path("/proc/cpuinfo")
    if table.is_file():
        for line in table.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return " ".join(line.partition(":")[2].split())
    return platform.processor() or platform.machine() or UNKNOWN


def linear_algebra() -> str:
    """Return the BLAS that numpy has loaded: name, version, kernel family and threads."""
    import numpy as np
    from threadpoolctl import threadpool_info

    np.linalg.norm(np.ones(2))  # a BLAS is listed once it is loaded
    found = {
        f"{pool['internal_api']} {pool.get('version')} {pool.get('architecture', '')} x{pool['num_threads']}"
        for pool in threadpool_info()
        if pool["user_api"] == "blas"
    }
    return "; ".join(sorted(found)) or UNKNOWN


def _dirty() -> str:
    status = _git("status", "--porcelain", "--untracked-files=no")
    return UNKNOWN if status is None else str(bool(status)).lower()


def _git(*arguments: str) -> str | None:
    """Return what git says about the checkout, or None where there is neither git nor checkout."""
    if not (_ROOT / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(_ROOT), *arguments], capture_output=True, text=True, timeout=20, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
