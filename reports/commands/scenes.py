"""`iapb scenes`: the scenes that come with the project."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from iapb.scene import find_scene, load_scene, scene_names


def scenes(json_: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False) -> None:
    """List the scenes that come with the project: their names, and what they show."""
    titles = {name: load_scene(find_scene(name)).title for name in scene_names()}
    if json_:
        print(json.dumps(titles, indent=1, ensure_ascii=False))
        return
    for name, title in titles.items():
        print(f"{name:<24}{title}")
