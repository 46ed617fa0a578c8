"""Scenes of these tests, from scenes.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from iapb.scene import Scene
from iapb.scene.reading import scene_from_values

G = 9.81
GIVEN = YAML(typ="safe").load(Path(__file__).with_name("scenes.yaml"))["scenes"]


def scene_of(name: str, **values: Any) -> Scene:
    """Return a scene by name; values by their paths, with __ for each dot."""
    changed = {path.replace("__", "."): value for path, value in values.items()}
    return scene_from_values(GIVEN[name]).with_values(changed)
