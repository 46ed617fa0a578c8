"""Scenes: what a scene file may say, read and checked."""

from iapb.scene.model import Scene
from iapb.scene.reading import load_scene, scene_from_text
from iapb.scene.schema import scene_schema
from iapb.scene.space import SpatialScene

__all__ = ["Scene", "SpatialScene", "load_scene", "scene_from_text", "scene_schema"]
