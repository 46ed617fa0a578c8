"""The JSON Schema of scene files judges every shipped scene as the reader does, in the plane and in
space."""

from __future__ import annotations

import contextlib
import re
from typing import Any

import pytest

from iapb.scene import SpatialScene, find_scene, scene_names, scene_schema
from iapb.scene.document import Document

SCHEMA = scene_schema()
TYPES: dict[str, Any] = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "null": type(None),
    "number": (int, float),
    "integer": int,
}
SILENT = {"$schema", "$defs", "title", "description", "default", "discriminator", "then", "else"}


def fits(value: Any, schema: Any) -> bool:
    """Return whether a value obeys a schema that uses the keywords below; any other keyword is a
    KeyError."""
    return all(
        RULES[word](value, given, schema) for word, given in schema.items() if word not in SILENT
    )


def of(kind: Any, holds: Any) -> Any:
    """A keyword that says something about values of one kind only."""
    return lambda value, given, schema: (
        not isinstance(value, kind) or bool(holds(value, given, schema))
    )


RULES: dict[str, Any] = {
    "$ref": lambda value, given, _: fits(value, SCHEMA["$defs"][given.rpartition("/")[2]]),
    "if": lambda value, given, schema: fits(
        value, schema["then" if fits(value, given) else "else"]
    ),
    "anyOf": lambda value, given, _: any(fits(value, part) for part in given),
    "oneOf": lambda value, given, _: sum(fits(value, part) for part in given) == 1,
    "enum": lambda value, given, _: value in given,
    "const": lambda value, given, _: value == given,
    "type": lambda value, given, _: (
        isinstance(value, TYPES[given])
        and not (isinstance(value, bool) and given in ("number", "integer"))
    ),
    "properties": of(
        dict, lambda value, given, _: all(fits(value[k], given[k]) for k in value if k in given)
    ),
    "additionalProperties": of(
        dict,
        lambda value, given, schema: all(
            given and fits(value[k], given) for k in value if k not in schema.get("properties", {})
        ),
    ),
    "items": of(list, lambda value, given, _: all(fits(item, given) for item in value)),
    "prefixItems": of(list, lambda value, given, _: all(map(fits, value, given))),
    "required": of(dict, lambda value, given, _: set(given) <= set(value)),
    "pattern": of(str, lambda value, given, _: re.search(given, value)),
    "minLength": of(str, lambda value, given, _: len(value) >= given),
    "maxLength": of(str, lambda value, given, _: len(value) <= given),
    "minItems": of(list, lambda value, given, _: len(value) >= given),
    "maxItems": of(list, lambda value, given, _: len(value) <= given),
    "minimum": of((int, float), lambda value, given, _: value >= given),
    "maximum": of((int, float), lambda value, given, _: value <= given),
}


def plain(name: str) -> Any:
    """The values of a scene file as they are written."""
    return Document(find_scene(name).read_text("utf-8")).value


@pytest.mark.parametrize("name", scene_names())
def test_shipped_scenes_keep_to_the_schema(name: str) -> None:
    assert fits(plain(name), SCHEMA)


@pytest.mark.parametrize(
    ("path", "value", "right"),
    [
        (("bodies", 0, "shapes", 0, "size"), [0.1, 0.1], False),
        (("dimensions",), 4, False),
        (("bodies", 0, "colour"), "red", False),
        (("contact",), "automatic", False),
        (("bodies", 1, "joint_damping"), [-1.0], False),
        (("contact",), "paper", True),
        (("bodies", 0, "joint_damping"), [1] * 6, True),
        (("hand",), {"body": "peg", "force_function": [1e10, 0, "t", 0, 0, 0]}, True),
    ],
)
def test_reader_and_schema_agree_on_a_scene_in_space(
    path: tuple[Any, ...], value: Any, right: bool
) -> None:
    scene = here = plain("peg_hole_space")
    for step in path[:-1]:
        here = here[step]
    here[path[-1]] = value
    assert fits(scene, SCHEMA) == right
    with contextlib.nullcontext() if right else pytest.raises(ValueError):
        SpatialScene.model_validate(scene)


def test_a_scene_in_space_names_its_dimensions_and_robots_alone_make_one() -> None:
    scene = plain("peg_hole_space")
    assert not fits({name: value for name, value in scene.items() if name != "dimensions"}, SCHEMA)
    robots = {name: value for name, value in plain("arm_obstacles").items() if name != "bodies"}
    assert fits(robots, SCHEMA) and fits(robots | {"contact": "paper"}, SCHEMA)
    assert not fits(robots | {"robots": [{"urdf": "arm.urdf"}]}, SCHEMA)  # a robot without a name


def test_every_field_is_described_and_no_part_takes_others() -> None:
    parts = SCHEMA["$defs"].values()
    fields = [
        (part["title"], name, field) for part in parts for name, field in part["properties"].items()
    ]
    assert not [f"{part}.{name}" for part, name, field in fields if not field.get("description")]
    assert all("default" in field["description"] for part, _, field in fields if part == "Contact")
    assert all(part["additionalProperties"] is False for part in parts)
