"""`iapb scenes`: the scenes that come with the project."""

from __future__ import annotations

from iapb.scene import find_scene, load_scene, scene_names
from reports.commands.as_json import Json, print_json


def scenes(json_: Json = False) -> None:
    """List the scenes that come with the project: their names, and what they show."""
    titles = {name: load_scene(find_scene(name)).title for name in scene_names()}
    if json_:
        print_json(titles)
        return
    for name, title in titles.items():
        print(f"{name:<24}{title}")
