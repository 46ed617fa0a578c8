"""`iapb schema`: the JSON Schema of scene files, for editors."""

from __future__ import annotations

import json

from iapb.scene import scene_schema


def schema() -> None:
    """Print the JSON Schema of scene files (for completion and checks in an editor)."""
    print(json.dumps(scene_schema(), indent=2))
