"""Scenes: what a scene file may say, read and checked."""

from iapb.scene.model import Scene
from iapb.scene.reading import load_scene, scene_from_text, scene_schema

__all__ = ["Scene", "load_scene", "scene_from_text", "scene_schema"]
