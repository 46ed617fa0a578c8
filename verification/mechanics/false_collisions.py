"""C18: false collisions of a ball that rolls in a faceted socket, with and without the two filters.

The facets approximate a round socket, in which the ball would collide only once. Every collision after the first
contact is therefore false, and every contact beyond one per step is a duplicate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate
from verification.finding import MIXED, REFUTED, REPRODUCED, Failure, Part, Table, of_each, titled

DAMPINGS = (10.0, 40.0, 60.0)  # B of (5) [N s/m]: with the smallest the ball bounces at edges, with the largest not
SCENE = "faceted_socket"
BALL_RADIUS, FACET_ANGLE = 0.02, math.radians(10.0)  # [m], [rad] of the scene
# Distance [m] between the ball's two contacts at an edge, which is the jump of a contact from facet to facet.
EDGE_JUMP = 2.0 * BALL_RADIUS * math.sin(0.5 * FACET_ANGLE)
SETTINGS = {
    "no filter": (False, False), "coherence alone": (False, True),
    "clustering alone": (True, False), "both filters": (True, True),
}  # fmt: skip

Simulate = Callable[[Scene], Run]


@dataclass(frozen=True)
class FalseCollisions:
    """Counts and losses in one run of the socket.

    clustering, coherence : whether each filter is on; damping : B [N s/m]
    collisions : number of impacts after the first contact
    new_contacts : number of contacts classified as new, without the first
    doubled : number of contacts beyond one per step
    lifted : number of steps without contact, after the first contact
    energy_lost : energy [J] lost in the false collisions
    potential_drop : drop [J] of the potential energy from the start to the lowest point, for comparison
    largest_speed : largest speed of the ball's centre [m/s]
    times, losses : time [s] of each false collision, and energy [J] lost in it
    """

    clustering: bool
    coherence: bool
    damping: float
    steps: int
    collisions: int
    new_contacts: int
    doubled: int
    lifted: int
    energy_lost: float
    potential_drop: float
    largest_speed: float
    times: tuple[float, ...]
    losses: tuple[float, ...]

    @property
    def setting(self) -> str:
        """The filters in words."""
        return next(name for name, filters in SETTINGS.items() if filters == (self.clustering, self.coherence))


def study_false_collisions(
    dampings: Sequence[float] = DAMPINGS, simulate: Simulate = simulate, failures: list[Failure] | None = None
) -> tuple[FalseCollisions, ...]:
    """Return the counts for each damping and each of the four filter settings, with the scene's filter distances."""

    def found(case: tuple[float, str]) -> list[FalseCollisions]:
        damping, setting = case
        return [count_false(socket(_switched_off(SETTINGS[setting]) | {"damping": damping}), simulate)]

    return tuple(of_each(product(dampings, SETTINGS), found, failures, lambda case: f"{case[1]}, {case[0]:g} N s/m"))


def _switched_off(filters: tuple[bool, bool]) -> dict[str, float]:
    names = ("cluster_distance", "coherence_distance")
    return {name: 0.0 for name, kept in zip(names, filters, strict=True) if not kept}


def socket(contact: Mapping[str, Any], rate: float | None = None) -> Scene:
    """Return the scene with some contact values changed, and perhaps another rate [Hz]."""
    values: dict[str, Any] = {f"contact.{name}": value for name, value in contact.items()}
    return _shipped().with_values(values if rate is None else values | {"rate": rate})


@cache
def _shipped() -> Scene:
    return load_scene(find_scene(SCENE))


def count_false(scene: Scene, simulate: Simulate = simulate) -> FalseCollisions:
    """Simulate the socket and count its false collisions."""
    run, contact = simulate(scene), scene.contact
    per_step = np.diff(run.contacts.offsets)
    first = int(np.flatnonzero(per_step)[0])
    later = run.impacts.step > first
    potential, lost = run.energy["potential"], run.impacts.energy_lost[later]
    return FalseCollisions(
        contact.cluster_distance > 0.0, contact.coherence_distance > 0.0, contact.damping, run.steps,
        collisions=int(later.sum()),
        new_contacts=int(run.contacts.is_new.sum() - run.contacts.is_new[: per_step[first]].sum()),
        doubled=int(np.maximum(per_step - 1, 0).sum()),
        lifted=int(np.sum(per_step[first:] == 0)),
        energy_lost=float(lost.sum()),
        potential_drop=float(potential[0] - potential.min()),
        largest_speed=float(np.hypot(run.v[:, 0], run.v[:, 1]).max()),
        times=tuple((run.impacts.step[later] * run.dt).tolist()), losses=tuple(lost.tolist()),
    )  # fmt: skip


def filters_table(found: Sequence[FalseCollisions]) -> Table:
    """Return a table with one row per run of the socket."""
    columns = ("filters", "damping [N s/m]", "false collisions", "contacts taken as new", "doubled contacts",
               "steps off the facets", "energy lost [J]", "energy lost, share of the fall")  # fmt: skip
    rows = [(f.setting, f.damping, f.collisions, f.new_contacts, f.doubled, f.lifted, f.energy_lost,
             f.energy_lost / f.potential_drop) for f in found]  # fmt: skip
    return titled(columns, rows, digits=3, note="The ball rolls for two seconds. In the round socket it has one "
                  "contact in each step and no collision after the first.")


def times_table(found: Sequence[FalseCollisions]) -> Table:
    """Return a table with one row per false collision, in order of time."""
    rows = [
        (f.setting, f.damping, time, count, sum(f.losses[:count]) / f.potential_drop)
        for f in found for count, time in enumerate(f.times, start=1)
    ]  # fmt: skip
    columns = ("filters", "damping [N s/m]", "time [s]", "false collisions so far",
               "energy lost so far, share of the fall")
    return titled(columns, rows)


def filters(found: Sequence[FalseCollisions]) -> Part:
    """Return the part on C18 with the scene's filter distances: with both filters, and with each alone."""
    of: dict[str, dict[float, FalseCollisions]] = {}
    for run in found:
        of.setdefault(run.setting, {})[run.damping] = run
    counts = "; ".join(f"{name} {', '.join(str(run.collisions) for run in runs.values())}" for name, runs in of.items())
    both, none = of["both filters"], of["no filter"]
    left = {damping: run for damping, run in both.items() if run.collisions}
    bounce = "".join(f" At {damping:g} N s/m the ball bounces off the facets ({run.lifted} steps without contact), and "
                     "each return is a new contact." for damping, run in left.items() if run.lifted)  # fmt: skip
    lost = max(run.energy_lost / run.potential_drop for run in none.values())
    doubled = [sum(run.doubled for run in runs.values()) for runs in (none, both)]
    return Part(
        "C18: false collisions of a ball that rolls in the faceted socket, at contact damping "
        f"{', '.join(f'{b:g}' for b in both)} N s/m and with filter distances above the {1e3 * EDGE_JUMP:.1f} mm "
        f"between contacts on neighbouring facets: {counts}. Without filters these collisions take up to {lost:.0%} of "
        "the potential energy of the fall. Coherence removes false collisions; clustering removes duplicate contacts "
        f"({doubled[0]} without filters, {doubled[1]} with both filters).{bounce}",
        REFUTED if len(left) == len(both) else MIXED if left else REPRODUCED,
        miss=f"false collisions remain at a damping of {', '.join(f'{b:g}' for b in left)} N s/m" if left else "",
    )  # fmt: skip
