"""Laws that need more than an impact resolver: a row budget, groups of contacts.

Each law draws its own cases and judges its own kind of subject; the last name in `@law` is the
engine's subject. To add a law, write its functions here, and add a planted fault to `planted`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.run import Run
from reference.exact import relative_energy_gain
from verification.impacts import EPS, ImpactCase, draw_case
from verification.laws.bounds import FACTORED, Found, Law, LawCount, law
from verification.laws.resolver import outcome
from verification.laws.scenes import ROOM, SceneCase, Values, draw_scene

ENGINE_LAWS: dict[str, Law] = {}  # the seeds of random cases depend on the order: add at the end


# Anytime property: every truncation of the projector is passive, so a row budget never costs
# passivity.
@law(
    ENGINE_LAWS,
    "truncation",
    "an impact stopped after any number of rows is passive; after no row, no impulse",
    partial(draw_case, largest_condition=1e12),
    resolve_impact,
)
def every_budget_is_passive(case: ImpactCase, subject: Callable[..., Any]) -> Found:
    """Largest relative energy gain over all budgets; infinite if a budget of 0 rows still gives an
    impulse."""
    answers = [
        outcome(partial(subject, budget=budget), case)
        for budget in range(min(case.contacts, case.coordinates) + 1)
    ]
    worst = max(relative_energy_gain(case.mass_matrix, case.velocity, v_plus) for v_plus in answers)
    idle = np.array_equal(answers[0], case.velocity)
    return worst if idle else np.inf, FACTORED.energy_gain(case)


# The engine splits the contacts of a step into groups and resolves each separately: two scenes
# without common contacts move the same, simulated together or apart, unless one passes a factor, a
# budget or a state on to the other.
# [m] between the rooms; a power of two, so that positions in both round alike
STEPS = 200
APART = 16.0


@dataclass(frozen=True)
class TwoRooms:
    """Two scenes far from each other, and one scene that contains both."""

    one: SceneCase
    other: SceneCase
    together: SceneCase


def draw_rooms(rng: np.random.Generator) -> TwoRooms:
    """Draw two random scenes; both use the step, gravity and contact constants of the first."""
    first = draw_scene(rng, STEPS).values
    kept = ("name", "rate", "duration", "integrator", "contact")
    common = {key: first[key] for key in kept} | {"gravity": first.get("gravity")}
    rooms = [
        _room(first["bodies"], "near", 0.0),
        _room(draw_scene(rng, STEPS).values["bodies"], "far", APART),
    ]
    both = {key: rooms[0][key] + rooms[1][key] for key in ("bodies", "walls")}
    return TwoRooms(*(SceneCase(common | room, "IAPB") for room in (*rooms, both)))


def _room(bodies: list[Values], name: str, x: float) -> Values:
    """Return the bodies, renamed and moved by x, and four slabs around them."""

    def moved(body: Values) -> Values:
        own = body | {"name": f"{name}_{body['name']}"}
        if "parent" in body:
            return own | {"parent": f"{name}_{body['parent']}"}
        if body["joint"] == "planar":
            return own | {"position": [body["position"][0] + x, *body["position"][1:]]}
        return own | {"origin": [x, 0.0]}

    sides = product(np.eye(2), (1.0, -1.0))
    walls = [
        {
            "name": f"{name}_{k}",
            "kind": "box",
            "size": (6.0 - 4.0 * axis).tolist(),
            "center": (sign * (ROOM + 1.0) * axis + [x, 0.0]).tolist(),
        }
        for k, (axis, sign) in enumerate(sides)
    ]
    return {"bodies": [moved(body) for body in bodies], "walls": walls}


@law(
    ENGINE_LAWS,
    "group_splitting",
    "a group moves the same, alone or beside another that it does not touch",
    draw_rooms,
    SceneCase.simulate,
)
def groups_apart_move_alike(case: TwoRooms, subject: Callable[[SceneCase], Run]) -> Found:
    """Distance between the states of the joint and the separate run, at the first instant at which
    they differ.

    A compiled sum over more entries may add them in another order, so the last bits may differ.
    Later instants are not judged, because collisions amplify such differences.
    """
    together = subject(case.together)
    one = subject(case.one)
    other = subject(case.other)
    d = one.v.shape[1]
    worst = max(
        _first_difference(together, one, slice(0, d)),
        _first_difference(together, other, slice(d, None)),
    )
    return worst, 100.0 * together.v.shape[1] * EPS


def _first_difference(together: Run, apart: Run, of: slice) -> float:
    """Largest relative difference of q and v at the first instant with a difference (nq = nv in
    these scenes)."""
    steps = 1 + min(together.steps, apart.steps)
    all_states = np.hstack([together.q[:steps, of], together.v[:steps, of]])
    own_states = np.hstack([apart.q[:steps], apart.v[:steps]])
    differs = np.flatnonzero(np.any(all_states != own_states, axis=1))
    if not len(differs):
        return 0.0
    a = all_states[differs[0]]
    b = own_states[differs[0]]
    return float(np.max(np.abs(a - b)) / np.max(np.abs(b)))


def judge_engine_law(
    name: str, subject: Callable[..., Any] | None = None, cases: int = 300, seed: int = 0
) -> LawCount:
    """Check one law on `cases` random cases; `subject` replaces the engine's own subject."""
    one = ENGINE_LAWS[name]
    rng = np.random.default_rng([seed, list(ENGINE_LAWS).index(name)])
    count = LawCount(name)
    for _ in range(cases):
        count.add(one.check(one.draw(rng), one.ours if subject is None else subject))
    return count
