"""Scenes: the format of scene files, and their reading and checking."""

from iapb.scene.model import Scene, SpatialScene, scene_schema
from iapb.scene.reading import find_scene, load_scene, scene_folder, scene_from_text, scene_names

__all__ = [
    "Scene",
    "SpatialScene",
    "find_scene",
    "load_scene",
    "scene_folder",
    "scene_from_text",
    "scene_names",
    "scene_schema",
]
