"""The provenance of a result: code, packages, processor and command, but no machine path and no
host name."""

from __future__ import annotations

import hashlib
import platform
import re
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_ROOT = Path(__file__).resolve().parent.parent
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "h5py")
# Packages that a report compares with or uses for its proofs.
PEERS = (
    "pin",
    "coal",
    "cvxpy",
    "clarabel",
    "qpsolvers",
    "daqp",
    "quadprog",
    "proxsuite",
    "quantecon",
    "sympy",
    "python-flint",
    "hypothesis",
    "mujoco",
)
UNKNOWN = "unknown"


def collect_provenance(
    seeds: Sequence[int | str] = (), packages: Sequence[str] = ()
) -> dict[str, str]:
    """Return the facts needed to reproduce a result, as texts by name.

    Parameters
    ----------
    seeds : seeds of the random numbers used, if any, each with or without its name.
    packages : further packages whose versions are stated, besides those that every result depends
        on.
    """
    given = {"seeds": ", ".join(map(str, seeds)) or "none", "command": current_command()}
    return _facts() | given | {package: package_version(package) for package in packages}


def current_command() -> str:
    """Return the command line of this process; paths that are absolute or contain ".." are cut to
    their last part."""

    def portable(word: str) -> str:
        option, equals, value = word.partition("=") if word.startswith("--") else ("", "", word)
        path = Path(value)
        return f"{option}{equals}{path.name}" if path.is_absolute() or ".." in path.parts else word

    program = Path(sys.argv[0])
    # as python -m reports.cli
    name = "iapb" if program.resolve() == _ROOT / "reports" / "cli.py" else program.name
    return shlex.join([name or "python", *map(portable, sys.argv[1:])])


@cache
def _facts() -> dict[str, str]:
    """Return the facts that do not change while the process runs."""
    return {
        "version": package_version("iapb"),
        "commit": _git("rev-parse", "HEAD") or UNKNOWN,
        "uncommitted changes": uncommitted_changes(),
        "lock": lock_hash(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "system": f"{platform.system()} {platform.machine()}",
        "cpu": processor(),
        "blas": linear_algebra(),
        "simd": dispatched(),
        **{package: package_version(package) for package in _PACKAGES},
    }


def package_version(package: str) -> str:
    """Return the version of an installed package, or ``not installed``."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


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
    """Return the BLAS of numpy: name, version, kernel family and threads.

    The BLAS libraries of other packages are ignored, so that a key does not depend on which
    packages are loaded.
    """
    import numpy as np
    from threadpoolctl import threadpool_info

    np.linalg.norm(np.ones(2))  # a BLAS is listed once it is loaded
    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    own = [pool for pool in pools if "numpy" in Path(pool["filepath"]).parent.name] or pools
    found = {
        f"{pool['internal_api']} {pool.get('version')} {pool.get('architecture', '')} x{pool['num_threads']}"
        for pool in own
    }
    return "; ".join(sorted(found)) or UNKNOWN


def dispatched() -> str:
    """Return the CPU features whose optional code numpy uses here; NPY_DISABLE_CPU_FEATURES can
    disable some."""
    try:
        numpy = import_module("numpy._core._multiarray_umath")
        return (
            " ".join(name for name in numpy.__cpu_dispatch__ if numpy.__cpu_features__[name])
            or "baseline"
        )
    except (ImportError, AttributeError):  # numpy does not promise these names
        return UNKNOWN


def machine_parts(facts: Mapping[str, str]) -> dict[str, str]:
    """Return the provenance facts besides the code that can change last bits: processor, BLAS,
    numpy's CPU features.

    The number of threads is left out, because it can change within a process.
    """
    kernels = sorted(set(re.findall(r"(\S+) x\d+", facts.get("blas", ""))))
    simd = f"numpy {facts['simd']}" if "simd" in facts else ""
    return {
        "cpu": facts.get("cpu", ""),
        "BLAS kernel": " and ".join(kernels),
        "CPU features of numpy": simd,
    }


@cache
def this_machine() -> str:
    """Return `machine_parts` of this process as one text; it is part of the keys of computed
    stages."""
    parts = machine_parts({"cpu": processor(), "blas": linear_algebra(), "simd": dispatched()})
    return ", ".join(text for text in parts.values() if text)


# Files that can change a result; changes of other files are ignored.
_TRACED = (
    "iapb",
    "reference",
    "verification",
    "reports",
    "scenes",
    "requirements.lock",
    "pyproject.toml",
)


def uncommitted_changes() -> str:
    """Return a hash of the uncommitted changes of sources, scenes and lock, new files among them.

    It is "none" without changes, and ``unknown`` without git or without a checkout.
    """
    changed = _git("diff", "HEAD", "--", *_TRACED)
    new = _git("ls-files", "--others", "--exclude-standard", "--", *_TRACED)
    if changed is None or new is None:
        return UNKNOWN
    if not changed and not new:
        return "none"
    digest = hashlib.sha256(changed.encode())
    for name in new.splitlines():
        digest.update(name.encode() + b"\0" + (_ROOT / name).read_bytes() + b"\0")
    return digest.hexdigest()


def _git(*arguments: str) -> str | None:
    """Return git's output for the checkout; None without git or checkout, or if git fails."""
    if not (_ROOT / ".git").exists():
        return None
    with suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(
            ["git", "-C", str(_ROOT), *arguments],
            capture_output=True,
            text=True,
            timeout=20,
            check=False,
        )
        return done.stdout.strip() if done.returncode == 0 else None
    return None
