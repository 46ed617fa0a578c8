"""What a rigid step costs is estimated from the scene: the contacts are those that the step is given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.scene import Scene, SpatialScene
from iapb.system import System
from reference import time_stepping
from reference.contact_rows import find_rows
from reference.time_stepping import cost_of
from reference.worlds import run_world


def row(count: int, kind: str) -> Scene:
    """Bodies of one kind in a row on a floor."""
    flat = kind in ("circle", "square")
    shape: dict[str, Any] = {
        "circle": {"kind": "circle", "radius": 0.05}, "square": {"kind": "box", "size": [0.1, 0.1]},
        "ball": {"kind": "sphere", "radius": 0.05}, "cube": {"kind": "box", "size": [0.1, 0.1, 0.1]}}[kind]
    bodies = [{"name": f"b{i}", "joint": "planar" if flat else "free_flyer", "mass": 1.0, "shapes": [shape],
               "inertia": 1e-3 if flat else [1e-3] * 3,
               "position": [0.12 * i, 0.05, 0.0] if flat else [0.12 * i, 0.0, 0.05, 0, 0, 0, 1]} for i in range(count)]
    floor = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]} if flat else {
        "name": "floor", "kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}
    given = {"name": "row", "rate": 1000.0, "duration": 0.003, "bodies": bodies, "walls": [floor]}
    return (Scene if flat else SpatialScene).model_validate(given | ({} if flat else {"dimensions": 3}))


@pytest.mark.parametrize(("kind", "most"), [("circle", 1.0), ("ball", 1.0), ("square", 1.0), ("cube", 2.0)])
def test_the_contacts_are_those_of_a_step_or_at_most_twice_as_many(kind: str, most: float) -> None:
    system = System(row(8, kind))
    state, cost = system.make_state(), cost_of(system)
    given = len(find_rows(system, state.q, state.v, np.inf).gap)
    assert given <= cost.contacts * 1.3 and cost.contacts <= most * given * 1.2
    assert cost.coordinates == system.mechanism.nv and cost.seconds > 0.0 and not cost.too_large


def test_too_many_are_refused_before_the_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_stepping, "MOST_ENTRIES", 500)
    assert run_world(row(4, "circle"), "ideal").complete
    for world in ("ideal", "ideal-friction"):
        with pytest.raises(ArgumentError, match=r"at most 500 numbers .* 36 contacts of 24 coordinates have 864"):
            run_world(row(8, "circle"), world)
