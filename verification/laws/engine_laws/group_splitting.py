"""Two rooms that share nothing: simulated together or apart, each moves the same, whatever happens in the other.

The engine splits the contacts of a step into groups and resolves each by itself; a factor, a budget or a state that
leaks from one group to another shows here.
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
APART = 16.0  # [m] between the rooms: a power of two, so that places in them round alike


@dataclass(frozen=True)
class TwoRooms:
    """Two scenes far from each other, and both as one."""

    one: SceneCase
    other: SceneCase
    together: SceneCase


def draw(rng: np.random.Generator) -> TwoRooms:
    """Bodies and walls of two random scenes; step, gravity and contact constants are those of the first."""
    first = draw_scene(rng, STEPS).values
    common = {key: first[key] for key in ("name", "rate", "duration", "contact")} | {"gravity": first.get("gravity")}
    rooms = [_room(first["bodies"], "near", 0.0), _room(draw_scene(rng, STEPS).values["bodies"], "far", APART)]
    both = {key: rooms[0][key] + rooms[1][key] for key in ("bodies", "walls")}
    one, other, together = (SceneCase(common | room, "IAPB") for room in (*rooms, both))
    return TwoRooms(one, other, together)


def _room(bodies: list[Values], name: str, x: float) -> Values:
    """The bodies, renamed and moved by x, inside four slabs."""
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
    """The engine."""
    return case.simulate()


def groups_apart_move_alike(case: TwoRooms, subject: Simulate) -> LawResidual:
    """Distance of the states, together and apart, at the first instant at which they differ at all.

    A compiled sum over more entries may take them in another order, so the last bits may differ; later instants follow
    from states that differ, and bodies that collide drive those apart. They are not judged.
    """
    together, one, other = subject(case.together), subject(case.one), subject(case.other)
    d = one.v.shape[1]
    worst = max(_first_difference(together, one, slice(0, d)), _first_difference(together, other, slice(d, None)))
    return LawResidual("group_splitting", worst, 100.0 * together.v.shape[1] * EPS)


def _first_difference(together: Run, apart: Run, of: slice) -> float:
    """Largest difference of q and v over their size, at that instant (nq = nv in these scenes)."""
    steps = 1 + min(together.steps, apart.steps)
    all_states = np.hstack([together.q[:steps, of], together.v[:steps, of]])
    own_states = np.hstack([apart.q[:steps], apart.v[:steps]])
    differs = np.flatnonzero(np.any(all_states != own_states, axis=1))
    if not len(differs):
        return 0.0
    a, b = all_states[differs[0]], own_states[differs[0]]
    return float(np.max(np.abs(a - b)) / np.max(np.abs(b)))
