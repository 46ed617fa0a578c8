"""The JSON Schema of scene files, for editors: planar scenes, and scenes in space with their robots."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import models_json_schema

from iapb.scene.model import Scene, SpatialScene
from iapb.scene.robots import Robot

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_HERE = "#/$defs/"


def scene_schema() -> dict[str, Any]:
    """Return the JSON Schema of scene files; every default stands in its field's description.

    A file with the field `dimensions` is judged as a scene in space, any other as a planar one, as the reader does.
    """
    _, schema = models_json_schema([(model, "validation") for model in (Scene, SpatialScene, Robot)])
    parts = schema["$defs"]
    parts["SpatialScene"] = _with_robots(parts["SpatialScene"])
    return {
        "$schema": DIALECT, "title": "Scene file", "type": "object",
        "if": {"required": ["dimensions"]},
        "then": {"$ref": f"{_HERE}SpatialScene"}, "else": {"$ref": f"{_HERE}Scene"},
        "$defs": parts,
    }


def _with_robots(space: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of scenes in space with the field `robots`, which the reader turns into bodies.

    A scene needs a body or a robot; where there are robots, `bodies` may be empty or left out.
    """
    robots = {"type": "array", "items": {"$ref": f"{_HERE}Robot"},
              "description": "URDF files that become bodies; default: none"}
    bodies = {name: value for name, value in space["properties"]["bodies"].items() if name != "minItems"}
    return space | {
        "properties": space["properties"] | {"bodies": bodies, "robots": robots},
        "required": [name for name in space["required"] if name != "bodies"],
        "anyOf": [{"required": ["bodies"], "properties": {"bodies": {"minItems": 1}}}, {"required": ["robots"]}],
    }
