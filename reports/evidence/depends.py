"""The external folders and packages that each stage reads; their hashes and versions are part of
the stage's key."""

from __future__ import annotations

import hashlib
from pathlib import Path

from reports.provenance import package_version
from verification.proofs import layout

BESIDE = Path(__file__).resolve().parents[3] / "shared"  # optional external files
ABSENT = "absent"

# stage -> folders beside the project that it reads where they exist
FOLDERS: dict[str, tuple[str, ...]] = {
    "complementarity": ("robots",),
    "haptic-rate": ("robots",),
}
# stage -> packages that it compares with, or leaves out where they are absent
PACKAGES: dict[str, tuple[str, ...]] = {
    "hard-cases": ("mujoco", "pin"),
    "accuracy": ("daqp", "quantecon"),
    "complementarity": (
        "cvxpy",
        "clarabel",
        "osqp",
        "scs",
        "qpsolvers",
        "daqp",
        "quadprog",
        "proxsuite",
        "quantecon",
        "pin",
        "coal",
    ),
    "haptic-rate": ("mujoco", "pin", "daqp", "quadprog", "proxsuite", "quantecon"),
}


def depends_of(stage: str) -> dict[str, str]:
    """Return the external dependencies of a stage by name: hashes of folders (or ABSENT) and
    package versions.

    Those of a part of a topic, such as "complementarity, without times", are the topic's.
    """
    stage = stage.partition(",")[0]
    folders = {name: folder_hash(BESIDE / name) for name in FOLDERS.get(stage, ())}
    if stage == "proofs":
        folders["statements"] = folder_hash(layout.FOLDER)
    return folders | {name: package_version(name) for name in PACKAGES.get(stage, ())}


def folder_hash(folder: Path) -> str:
    """Return sha256 of the names and bytes of every file below a folder; ABSENT where there is no
    such folder."""
    if not folder.is_dir():
        return ABSENT
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        digest.update(
            path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0"
        )
    return digest.hexdigest()
