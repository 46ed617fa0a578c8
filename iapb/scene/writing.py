"""A scene as YAML text."""

from __future__ import annotations

import io

from iapb.scene.model import Scene


def scene_text(scene: Scene, comment: str = "") -> str:
    """Return YAML text that reads back as this scene, exact to the last bit."""
    from ruamel.yaml import YAML

    yaml, stream = YAML(typ="safe", pure=True), io.StringIO()
    yaml.default_flow_style, yaml.sort_base_mapping_type_on_output = None, False  # type: ignore[assignment]
    yaml.dump(scene.resolved(), stream)
    return (f"# {comment}\n" if comment else "") + stream.getvalue()
