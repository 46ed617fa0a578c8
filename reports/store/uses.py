"""The runs that a result was made from, and the command that reproduces each run."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from iapb.errors import ArgumentError, IapbError, SceneError
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.scene.document import Document
from iapb.scene.model import set_value


@dataclass(frozen=True)
class StoredFile:
    """A run that was read or written for a result.

    file : name within the folder of runs
    content_hash : hash of the results
    command : reproduces the run
    used_by : the claims, topics and figure inputs that used it
    """

    file: str
    content_hash: str
    command: str
    used_by: tuple[str, ...] = ()


def run_command(scene: Scene, world: str, rendering: str = "full") -> str:
    """Return the `iapb run` command that simulates this scene in this world; "" if no scene of the
    project matches.

    The values in the command are checked: parsed as the command parses them, they must give the
    scene to the last bit.
    """
    if scene.name not in scene_names():
        return ""
    wanted = scene.resolved()
    again = _shipped(scene.name).resolved()
    sets = [f"{path}={json.dumps(value)}" for path, value in changes(again, wanted)]
    try:
        for path, value in parsed(sets).items():
            set_value(again, path, value)
    except IapbError:
        return ""
    words = [
        "iapb",
        "run",
        scene.name,
        *(word for text in sets for word in ("--set", text)),
        "--world",
        world,
    ]
    return (
        shlex.join(words + ["--rendering", rendering] * (rendering != "full"))
        if again == wanted
        else ""
    )


_INDEX = re.compile(r"\[(\d+)\]")  # as messages write a place in a list


def parsed(assignments: list[str]) -> dict[str, Any]:
    """Turn ``path=value`` into values by path (``bodies[0].mass`` or ``bodies.0.mass``); values are
    read as YAML."""
    values = {}
    for text in assignments:
        path, equals, value = text.partition("=")
        if not equals or not path:
            raise ArgumentError("--set", text, "path=value, such as contact.friction=0.3")
        try:
            values[_INDEX.sub(r".\1", path.strip())] = Document(value).value
        except SceneError as error:
            said = error.mistakes[0].expected
            raise ArgumentError(
                "--set", text, f"a YAML value after the equals sign: {said}"
            ) from None
    return values


@cache
def _shipped(name: str) -> Scene:
    return load_scene(find_scene(name))


def changes(old: Any, new: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (dotted path, new value) for each difference of two resolved scenes, at the deepest
    possible path.

    A list whose items do not all have different names can only be set as a whole.
    """
    if (
        isinstance(old, list)
        and isinstance(new, list)
        and _names(new)
        and _names(old) == _names(new)
    ):
        old, new = (dict(zip(_names(items), items, strict=True)) for items in (old, new))
    if isinstance(old, Mapping) and isinstance(new, Mapping) and list(old) == list(new):
        for step in new:
            yield from changes(old[step], new[step], f"{path}.{step}".lstrip("."))
    elif old != new:
        yield path, new


def _names(items: list[Any]) -> list[str]:
    names = [item["name"] for item in items if isinstance(item, Mapping) and item.get("name")]
    return names if len(set(names)) == len(items) else []
