"""`iapb schema`: the JSON Schema of scene files, for editors."""

from __future__ import annotations

import json

from iapb.scene import scene_schema
from reports.show import Answer


def schema() -> Answer:
    """Print the JSON Schema of scene files (for completion and checks in an editor)."""
    return Answer({}, [json.dumps(scene_schema(), indent=2)])
