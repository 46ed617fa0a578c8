"""Scenes of these tests, made of their bodies."""

from __future__ import annotations

from typing import Any

from iapb.scene import Scene, SpatialScene

G = 9.81


def scene_of(
    *bodies: dict[str, Any],
    space: bool = True,
    gravity: float = 0.0,
    floor: float | None = None,
    **given: Any,
) -> Any:
    """Return a scene of free bodies of 1 kg at 1 kHz, by default; `floor`: its height."""
    down = [0.0, 0.0, -1.0] if space else [0.0, -1.0]
    kind = "half_space" if space else "half_plane"
    walls = (
        []
        if floor is None
        else [
            {
                "name": "floor",
                "kind": kind,
                "point": [-floor * x for x in down],
                "normal": [-x for x in down],
            }
        ]
    )
    own = {"joint": "free_flyer" if space else "planar", "mass": 1.0}
    return (SpatialScene if space else Scene).model_validate(
        {
            "name": "made",
            "rate": 1000.0,
            "duration": 10.0,
            "gravity": [gravity * x for x in down],
            "walls": walls,
            "bodies": [{"name": f"body_{k}"} | own | body for k, body in enumerate(bodies)],
        }
        | ({"dimensions": 3} if space else {})
        | given
    )
