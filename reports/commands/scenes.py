"""`iapb scenes`: the scenes that come with the project."""

from __future__ import annotations

from iapb.scene import find_scene, load_scene, scene_names
from reports.show import Answer, Json


def scenes(json_: Json = False) -> Answer:
    """List the scenes that come with the project: their names, and what they show."""
    titles = {name: load_scene(find_scene(name)).title for name in scene_names()}
    return Answer(titles, [f"{name:<24}{title}" for name, title in titles.items()])
