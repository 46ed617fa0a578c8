"""Scenes of these tests, from scenes.yaml."""

from __future__ import annotations

from typing import Any

from iapb.scene import Scene
from tests.given import data_of, scene_with

G = 9.81
GIVEN = data_of(__file__, "scenes.yaml")["scenes"]


def scene_of(name: str, **values: Any) -> Scene:
    return scene_with(GIVEN[name], **values)
