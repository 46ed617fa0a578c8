"""Hash every dataset of every shipped scene in every engine world over its full duration, or compare two such files.

    python -m tests.oracle store FILE
    python -m tests.oracle compare OLD NEW
"""

from __future__ import annotations

import json
import os
import sys
from dataclasses import fields
from pathlib import Path

os.environ.setdefault("IAPB_COMPILE", "whole")

from iapb.run import Run
from iapb.scene import load_scene
from iapb.simulation import simulate
from tests.iapb.same_bits import SCENES, _hash

ENGINE_WORLDS = ("IAPB", "PB", "IAPB-friction", "IAPB-push")
NOT_NUMBERS = ("chunk_steps", "chunk_seconds", "kernel", "scene_source")


def hashes_of(run: Run) -> dict[str, str]:
    """Return one hash for each dataset of a run; tables and mappings have one for each column."""
    found = {}
    for field in fields(run):
        value = getattr(run, field.name)
        if field.name in NOT_NUMBERS:
            continue
        columns = value if isinstance(value, dict) else vars(value) if hasattr(value, "__dataclass_fields__") else None
        for name, column in {"": value}.items() if columns is None else columns.items():
            found[f"{field.name}.{name}".rstrip(".")] = _hash(column)
    return found


def stored(path: Path) -> None:
    """Run every scene in every engine world and write the hashes as JSON."""
    found = {f"{scene.stem} {world}": hashes_of(simulate(load_scene(scene), world=world))
             for scene in sorted(SCENES.glob("*.yaml")) for world in ENGINE_WORLDS}
    path.write_text(json.dumps(found, indent=1))


def differences(old: Path, new: Path) -> list[str]:
    """Return one line for each run with datasets that differ, or that only one file has."""
    before, after = json.loads(old.read_text()), json.loads(new.read_text())
    lines = []
    for name in sorted(before.keys() | after.keys()):
        left, right = before.get(name, {}), after.get(name, {})
        differ = [key for key in sorted(left.keys() | right.keys()) if left.get(key) != right.get(key)]
        lines += [f"{name}: {', '.join(differ)}"] if differ else []
    return lines


if __name__ == "__main__":
    if sys.argv[1] == "store":
        stored(Path(sys.argv[2]))
    else:
        told = differences(*map(Path, sys.argv[2:4]))
        print("\n".join(told) or "every dataset is equal")
        sys.exit(bool(told))
