"""Law of group splitting: two scenes without common contacts move the same, whether simulated together or separately.

The engine splits the contacts of a step into groups and resolves each group separately. This law detects a factor, a
budget or a state that one group passes on to another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from iapb.run import Run
from verification.laws.bounds import LawResidual
from verification.laws.scenes import ROOM, SceneCase, Values, draw_scene

Simulate = Callable[[SceneCase], Run]
STEPS = 200
EPS = float(np.finfo(float).eps)
APART = 16.0  # [m] between the rooms; a power of two, so that positions in both round alike


@dataclass(frozen=True)
class TwoRooms:
    """Two scenes far from each other, and one scene that contains both."""

    one: SceneCase
    other: SceneCase
    together: SceneCase


def draw(rng: np.random.Generator) -> TwoRooms:
    """Draw two random scenes; both use the step, gravity and contact constants of the first."""
    first = draw_scene(rng, STEPS).values
    kept = ("name", "rate", "duration", "integrator", "contact")
    common = {key: first[key] for key in kept} | {"gravity": first.get("gravity")}
    rooms = [_room(first["bodies"], "near", 0.0), _room(draw_scene(rng, STEPS).values["bodies"], "far", APART)]
    both = {key: rooms[0][key] + rooms[1][key] for key in ("bodies", "walls")}
    one, other, together = (SceneCase(common | room, "IAPB") for room in (*rooms, both))
    return TwoRooms(one, other, together)


def _room(bodies: list[Values], name: str, x: float) -> Values:
    """Return the bodies, renamed and moved by x, and four slabs around them."""
    moved = [_moved(body, name, x) for body in bodies]
    middle = ROOM + 1.0
    upright, flat = [2.0, 6.0], [6.0, 2.0]
    slabs = {(middle, 0.0): upright, (-middle, 0.0): upright, (0.0, middle): flat, (0.0, -middle): flat}
    walls = [
        {"name": f"{name}_{k}", "kind": "box", "size": size, "center": [x + a, b]}
        for k, ((a, b), size) in enumerate(slabs.items())
    ]
    return {"bodies": moved, "walls": walls}


def _moved(body: Values, name: str, x: float) -> Values:
    moved = body | {"name": f"{name}_{body['name']}"}
    if "parent" in body:
        return moved | {"parent": f"{name}_{body['parent']}"}
    if body["joint"] == "planar":
        return moved | {"position": [body["position"][0] + x, *body["position"][1:]]}
    return moved | {"origin": [x, 0.0]}


def ours(case: SceneCase) -> Run:
    """Simulate the scene with the engine."""
    return case.simulate()


def groups_apart_move_alike(case: TwoRooms, subject: Simulate) -> LawResidual:
    """Distance between the states of the joint and the separate run, at the first instant at which they differ.

    A compiled sum over more entries may add them in another order, so the last bits may differ. Later instants are not
    judged, because collisions amplify such differences.
    """
    together, one, other = subject(case.together), subject(case.one), subject(case.other)
    d = one.v.shape[1]
    worst = max(_first_difference(together, one, slice(0, d)), _first_difference(together, other, slice(d, None)))
    return LawResidual("group_splitting", worst, 100.0 * together.v.shape[1] * EPS)


def _first_difference(together: Run, apart: Run, of: slice) -> float:
    """Largest relative difference of q and v at the first instant with a difference (nq = nv in these scenes)."""
    steps = 1 + min(together.steps, apart.steps)
    all_states = np.hstack([together.q[:steps, of], together.v[:steps, of]])
    own_states = np.hstack([apart.q[:steps], apart.v[:steps]])
    differs = np.flatnonzero(np.any(all_states != own_states, axis=1))
    if not len(differs):
        return 0.0
    a, b = all_states[differs[0]], own_states[differs[0]]
    return float(np.max(np.abs(a - b)) / np.max(np.abs(b)))
