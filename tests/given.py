"""What lies beside the tests as data: scenes and tables in YAML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from iapb.scene import Scene
from iapb.scene.reading import scene_from_values


def data_of(test: str, name: str) -> Any:
    """Return the content of a file beside a test."""
    return YAML(typ="safe").load(Path(test).with_name(name))


def scene_with(values: Any, **changed: Any) -> Scene:
    """Return the scene of plain values, some of them changed by their paths, with __ for dots."""
    paths = {path.replace("__", "."): value for path, value in changed.items()}
    return scene_from_values(values).with_values(paths)
