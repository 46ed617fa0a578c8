"""C18: false collisions of a ball that rolls in a faceted socket, with and without the two filters.

The facets approximate a round socket, in which the ball would collide only once. Every collision after the first
contact is therefore false, and every contact beyond one per step is a duplicate.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from verification.check import Check, Study
from verification.finding import MIXED, REFUTED, REPRODUCED, Part
from verification.table import Row, Table

DAMPINGS = (10.0, 40.0, 60.0)  # B of (5) [N s/m]: with the smallest the ball bounces at edges, with the largest not
SCENE = "faceted_socket"
BALL_RADIUS, FACET_ANGLE = 0.02, math.radians(10.0)  # [m], [rad] of the scene
# Distance [m] between the ball's two contacts at an edge, which is the jump of a contact from facet to facet.
EDGE_JUMP = 2.0 * BALL_RADIUS * math.sin(0.5 * FACET_ANGLE)
SETTINGS = {
    "no filter": (False, False), "coherence alone": (False, True),
    "clustering alone": (True, False), "both filters": (True, True),
}  # fmt: skip


@dataclass(frozen=True)
class FalseCollisions:
    """Counts and losses in one run of the socket.

    collisions : number of impacts after the first contact
    new_contacts : number of contacts classified as new, without the first
    doubled : number of contacts beyond one per step
    lifted : number of steps without contact, after the first contact
    energy_lost : energy [J] lost in the false collisions
    potential_drop : drop [J] of the potential energy from the start to the lowest point, for comparison
    largest_speed : largest speed of the ball's centre [m/s]
    times, losses : time [s] of each false collision, and energy [J] lost in it
    """

    collisions: int
    new_contacts: int
    doubled: int
    lifted: int
    energy_lost: float
    potential_drop: float
    largest_speed: float
    times: tuple[float, ...]
    losses: tuple[float, ...]


def socket(contact: Mapping[str, Any], rate: float | None = None) -> Scene:
    """Return the scene with some contact values changed, and perhaps another rate [Hz]."""
    values: dict[str, Any] = {f"contact.{name}": value for name, value in contact.items()}
    return _shipped().with_values(values if rate is None else values | {"rate": rate})


@cache
def _shipped() -> Scene:
    return load_scene(find_scene(SCENE))


def count_false(run: Run) -> FalseCollisions:
    """Count the false collisions of a run of the socket."""
    per_step = np.diff(run.contacts.offsets)
    first = int(np.flatnonzero(per_step)[0])
    later = run.impacts.step > first
    potential, lost = run.energy["potential"], run.impacts.energy_lost[later]
    return FalseCollisions(
        collisions=int(later.sum()),
        new_contacts=int(run.contacts.is_new.sum() - run.contacts.is_new[: per_step[first]].sum()),
        doubled=int(np.maximum(per_step - 1, 0).sum()),
        lifted=int(np.sum(per_step[first:] == 0)),
        energy_lost=float(lost.sum()),
        potential_drop=float(potential[0] - potential.min()),
        largest_speed=float(np.hypot(run.v[:, 0], run.v[:, 1]).max()),
        times=tuple((run.impacts.step[later] * run.dt).tolist()), losses=tuple(lost.tolist()),
    )  # fmt: skip


def _cases(_: Study) -> Iterator[tuple[str, float]]:
    return ((setting, damping) for damping, setting in product(DAMPINGS, SETTINGS))


def _found(study: Study, case: tuple[str, float]) -> FalseCollisions:
    """Return the counts with the scene's filter distances, one or both of which may be switched off."""
    setting, damping = case
    names = ("cluster_distance", "coherence_distance")
    off = {name: 0.0 for name, kept in zip(names, SETTINGS[setting], strict=True) if not kept}
    return study.once(("socket", *case), lambda: count_false(study.run(socket(off | {"damping": damping}), "IAPB")))


def _counts(study: Study, case: tuple[str, float]) -> Row:
    found = _found(study, case)
    return {"filters": case[0], "damping [N s/m]": case[1], "false collisions": found.collisions,
            "contacts taken as new": found.new_contacts, "doubled contacts": found.doubled,
            "steps off the facets": found.lifted, "energy lost [J]": found.energy_lost,
            "energy lost, share of the fall": found.energy_lost / found.potential_drop}  # fmt: skip


def _times(study: Study, case: tuple[str, float]) -> Iterator[Row]:
    found = _found(study, case)
    for count, time in enumerate(found.times, start=1):
        yield {"filters": case[0], "damping [N s/m]": case[1], "time [s]": time, "false collisions so far": count,
               "energy lost so far, share of the fall": sum(found.losses[:count]) / found.potential_drop}  # fmt: skip


def filters(table: Table) -> Part:
    """Return the part on C18 with the scene's filter distances: with both filters, and with each alone."""
    counts = "; ".join(f"{name} {', '.join(map(str, table.where(filters=name).column('false collisions')))}"
                       for name in SETTINGS)  # fmt: skip
    both, none = table.where(filters="both filters").records(), table.where(filters="no filter").records()
    left = [row for row in both if row["false collisions"]]
    lifted = [(row["damping"], row["steps off the facets"]) for row in left if row["steps off the facets"]]
    bounce = "".join(f" At {damping:g} N s/m the ball bounces off the facets ({steps} steps without contact), and each "
                     "return is a new contact." for damping, steps in lifted)  # fmt: skip
    lost = max(row["energy lost, share of the fall"] for row in none)
    doubled = [sum(row["doubled contacts"] for row in rows) for rows in (none, both)]
    return Part(
        "C18: false collisions of a ball that rolls in the faceted socket, at contact damping "
        f"{', '.join(f'{b:g}' for b in table.where(filters='both filters').column('damping'))} N s/m and with filter "
        f"distances above the {1e3 * EDGE_JUMP:.1f} mm "
        f"between contacts on neighbouring facets: {counts}. Without filters these collisions take up to {lost:.0%} of "
        "the potential energy of the fall. Coherence removes false collisions; clustering removes duplicate contacts "
        f"({doubled[0]} without filters, {doubled[1]} with both filters).{bounce}",
        REFUTED if len(left) == len(both) else MIXED if left else REPRODUCED,
        miss=f"false collisions remain at a damping of {', '.join(format(row['damping'], 'g') for row in left)} N s/m"
        if left else "",
    )  # fmt: skip


IN_TIME = Check(key="false collisions in time", question="When do the false collisions happen?", cases=_cases,
                row=_times)  # fmt: skip
FALSE_COLLISIONS = Check(
    key="false collisions", question="Do the filters remove false collisions?", cases=_cases, row=_counts, says=filters,
    digits=3, note="The ball rolls for two seconds. In the round socket it has one contact in each step and no "
                   "collision after the first.",
)  # fmt: skip
