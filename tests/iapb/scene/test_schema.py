"""The JSON Schema of scene files judges every shipped scene as the reader does, in the plane and in space."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from iapb.scene import find_scene, scene_names, scene_schema
from iapb.scene.document import Document

SCHEMA = scene_schema()


def plain(name: str) -> Any:
    """The values of a scene file as they are written."""
    return Document(find_scene(name).read_text("utf-8")).value


@pytest.mark.parametrize("name", scene_names())
def test_shipped_scenes_keep_to_the_schema(name: str) -> None:
    assert not list(faults(plain(name), SCHEMA, SCHEMA))


def _planar_vector(scene: Any) -> None:
    scene["bodies"][0]["shapes"][0]["size"] = [0.1, 0.1]


def _unknown_joint(scene: Any) -> None:
    scene["bodies"][0]["joint"] = "planar"


def _planar_file(scene: Any) -> None:
    del scene["dimensions"]


def _four_dimensions(scene: Any) -> None:
    scene["dimensions"] = 4


def _unknown_field(scene: Any) -> None:
    scene["bodies"][0]["colour"] = "red"


def _nothing_in_it(scene: Any) -> None:
    scene["bodies"] = []


@pytest.mark.parametrize(
    "spoil", [_planar_vector, _unknown_joint, _planar_file, _four_dimensions, _unknown_field, _nothing_in_it]
)
def test_faults_planted_in_a_scene_in_space_are_seen(spoil: Callable[[Any], None]) -> None:
    scene = copy.deepcopy(plain("peg_hole_space"))
    spoil(scene)
    assert list(faults(scene, SCHEMA, SCHEMA))


def test_robots_alone_make_a_scene() -> None:
    scene = plain("arm_obstacles")
    alone = {name: value for name, value in scene.items() if name != "bodies"}
    assert not list(faults(alone, SCHEMA, SCHEMA))
    assert list(faults({**alone, "robots": [{"urdf": "arm.urdf"}]}, SCHEMA, SCHEMA))  # a robot without a name


# A judge of plain values by a JSON Schema: the keywords that ours uses; any other is a KeyError.
_TYPES: dict[str, Any] = {
    "object": dict, "array": list, "string": str, "boolean": bool, "null": type(None), "number": (int, float),
    "integer": int,
}
_SAYS_NOTHING = {"$schema", "$defs", "title", "description", "default", "discriminator", "then", "else"}


def faults(value: Any, schema: Mapping[str, Any], root: Mapping[str, Any], place: str = "") -> Iterator[str]:
    """Yield where and how a value departs from a schema; `root` holds what it refers to."""
    for keyword, given in schema.items():
        if keyword in _SAYS_NOTHING:
            continue
        yield from _KEYWORDS[keyword](value, given, schema, root, place)


def _reference(value: Any, given: str, schema: Any, root: Any, place: str) -> Iterator[str]:
    yield from faults(value, root["$defs"][given.removeprefix("#/$defs/")], root, place)


def _if(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
    branch = "else" if any(faults(value, given, root)) else "then"
    yield from faults(value, schema[branch], root, place)


def _properties(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
    for name, part in given.items():
        if isinstance(value, dict) and name in value:
            yield from faults(value[name], part, root, f"{place}.{name}")


def _additional(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
    for name in value if isinstance(value, dict) else ():
        if name not in schema.get("properties", {}):
            yield from [f"{place}.{name}: unknown"] if given is False else faults(value[name], given, root, place)


def _items(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
    for i, item in enumerate(value if isinstance(value, list) else ()):
        yield from faults(item, given, root, f"{place}[{i}]")


def _prefix(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
    for i, (item, part) in enumerate(zip(value, given, strict=False) if isinstance(value, list) else ()):
        yield from faults(item, part, root, f"{place}[{i}]")


def _choice(least: int, most: float) -> Any:
    def judge(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
        fitting = sum(not any(faults(value, part, root)) for part in given)
        if not least <= fitting <= most:
            yield f"{place}: fits {fitting} of the choices"

    return judge


def _rule(kind: Any, holds: Any) -> Any:
    """A keyword that says something about values of one kind only."""

    def judge(value: Any, given: Any, schema: Any, root: Any, place: str) -> Iterator[str]:
        if isinstance(value, kind) and not isinstance(value, bool) and not holds(value, given):
            yield f"{place}: {value!r} against {given!r}"

    return judge


def _type(value: Any, given: str, schema: Any, root: Any, place: str) -> Iterator[str]:
    if not isinstance(value, _TYPES[given]) or (isinstance(value, bool) and given in ("number", "integer")):
        yield f"{place}: {value!r} is no {given}"


_KEYWORDS: dict[str, Any] = {
    "$ref": _reference, "if": _if, "properties": _properties, "additionalProperties": _additional, "items": _items,
    "prefixItems": _prefix, "anyOf": _choice(1, float("inf")), "oneOf": _choice(1, 1), "type": _type,
    "required": _rule(dict, lambda value, names: all(name in value for name in names)),
    "enum": _rule(object, lambda value, allowed: value in allowed),
    "const": _rule(object, lambda value, only: value == only),
    "pattern": _rule(str, lambda value, pattern: re.search(pattern, value) is not None),
    "minLength": _rule(str, lambda value, least: len(value) >= least),
    "maxLength": _rule(str, lambda value, most: len(value) <= most),
    "minItems": _rule(list, lambda value, least: len(value) >= least),
    "maxItems": _rule(list, lambda value, most: len(value) <= most),
    "minimum": _rule((int, float), lambda value, least: value >= least),
    "maximum": _rule((int, float), lambda value, most: value <= most),
    "exclusiveMinimum": _rule((int, float), lambda value, bound: value > bound),
}
