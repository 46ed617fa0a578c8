"""A scene with some values changed: for sweeps, and checked like a file."""

from __future__ import annotations

import copy
from typing import Any

from pydantic import ValidationError

from iapb.errors import ArgumentError, SceneError
from iapb.names import one_of
from iapb.scene.model import Scene
from iapb.scene.reading import mistakes_of
from iapb.scene.writing import scene_text


def changed(scene: Scene, values: dict[str, Any]) -> Scene:
    """Return the scene with new values by dotted path; see `Scene.with_values`."""
    plain = scene.resolved()
    for path, value in values.items():
        set_value(plain, path, value)
    try:
        made = type(scene).model_validate(plain)
    except ValidationError as failure:
        raise SceneError(
            mistakes_of(failure, f"scene {scene.name} with new values", values=plain)
        ) from failure
    made._source_text = scene_text(made, f"{scene.name} with new values for {', '.join(values) or 'nothing'}")
    return made


def set_value(plain: dict[str, Any], path: Any, value: Any) -> None:
    """Put a value at a dotted path of a resolved scene, unchecked; a section that is absent is made."""
    if not isinstance(path, str) or not path:
        raise ArgumentError("values", path, "dotted paths as keys, such as contact.friction")
    steps = path.split(".")
    place: Any = plain
    for i, step in enumerate(steps):
        key = _key(place, step, path)
        if i == len(steps) - 1:
            place[key] = _plain(value)
            return
        if isinstance(place, dict) and place.get(key) is None:
            place[key] = {}
        place = place[key]


def _plain(value: Any) -> Any:
    """Return a value of the caller's own: a copy, numpy arrays and numbers as plain ones."""
    return value.tolist() if hasattr(value, "tolist") else copy.deepcopy(value)


def _key(place: Any, step: str, path: str) -> str | int:
    """Return the key or index that a step of a path means in this place."""
    if isinstance(place, dict):
        return step
    if not isinstance(place, list):
        raise ArgumentError("values", path, f"a path into the scene: {step!r} lies below a value")
    names = [item.get("name") if isinstance(item, dict) else None for item in place]
    if step in names:
        return names.index(step)
    if step.isdecimal() and int(step) < len(place):
        return int(step)
    known = [name for name in names if name] or [f"0 to {len(place) - 1}"]
    raise ArgumentError("values", path, one_of(step, known, f"at {step!r} one of: "))
