"""C18: false collisions of a ball that rolls in a faceted socket: those after the first, as in a round socket."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
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
RADIUS, BALL_RADIUS, FACETS, STEEP = 0.2, 0.02, 9, math.radians(70.0)  # [m], facets in a right angle, start [rad]
LARGEST_SPEED = 1.2445  # [m/s] of a ball that rolls down from there without loss
COUNTED = ("false collisions", "contacts taken as new", "doubled contacts", "steps off the facets", "energy lost [J]",
           "energy lost, share of the fall")
SETTINGS = {  # the filter distances that are switched off
    "no filter": ("cluster_distance", "coherence_distance"), "coherence alone": ("cluster_distance",),
    "clustering alone": ("coherence_distance",), "both filters": (),
}  # fmt: skip


def edge_jump(facets: int = FACETS) -> float:
    """Distance [m] between the ball's two contacts at an edge, which is the jump of a contact from facet to facet."""
    return 2.0 * BALL_RADIUS * math.sin(0.25 * math.pi / facets)


def socket(contact: Mapping[str, Any], rate: float | None = None, facets: int = FACETS) -> Scene:
    """Return the scene with some contact values changed, and perhaps another rate [Hz] or number of facets."""
    values: dict[str, Any] = {f"contact.{name}": value for name, value in contact.items()}
    return _faceted(facets).with_values(values if rate is None else values | {"rate": rate})


@cache
def _faceted(facets: int) -> Scene:
    """Return the shipped scene, or the same socket and start with another number of facets in a right angle."""
    scene, angle = load_scene(find_scene(SCENE)), 0.5 * math.pi / facets
    if facets == FACETS:
        return scene

    def point(radius: float, number: float) -> list[float]:
        return [radius * math.sin(number * angle), -radius * math.cos(number * angle)]

    corners = (1.0, -0.5), (1.1, -0.5), (1.1, 0.5), (1.0, 0.5)
    walls = [{"name": f"facet_{number}", "kind": "polygon",
              "vertices": [point(RADIUS * out, number + side) for out, side in corners]}
             for number in range(-facets, facets + 1)]  # fmt: skip
    touching = RADIUS * math.cos(0.5 * angle) - BALL_RADIUS + 1e-6  # by a micrometre
    start = point(touching, -round(STEEP / angle))
    return scene.with_values({"walls": walls, "bodies.ball.position": [*start, 0.0]})


def count_false(run: Run) -> dict[str, Any]:
    """Count the false collisions of a run of the socket.

    Besides the columns of the table: "on return", those in the step after one without contact; and for each false
    collision the time [s], and the energy lost so far as a share of the fall, from the start to the lowest point.
    """
    per_step = np.diff(run.contacts.offsets)
    first = int(np.flatnonzero(per_step)[0])
    later = run.impacts.step > first
    potential, lost = run.energy["potential"], run.impacts.energy_lost[later]
    losses, fall = lost.tolist(), float(potential[0] - potential.min())
    return {
        "false collisions": int(later.sum()),
        "contacts taken as new": int(run.contacts.is_new.sum() - run.contacts.is_new[: per_step[first]].sum()),
        "doubled contacts": int(np.maximum(per_step - 1, 0).sum()),
        "steps off the facets": int(np.sum(per_step[first:] == 0)), "energy lost [J]": float(lost.sum()),
        "energy lost, share of the fall": float(lost.sum()) / fall,
        "on return": int(np.sum(per_step[run.impacts.step[later] - 1] == 0)),
        "times": (run.impacts.step[later] * run.dt).tolist(),
        "shares": [sum(losses[:count]) / fall for count in range(1, len(losses) + 1)],
    }  # fmt: skip


def _cases(_: Study) -> Iterator[tuple[str, float]]:
    return ((setting, damping) for damping, setting in product(DAMPINGS, SETTINGS))


def found_with(study: Study, case: tuple[str, float]) -> dict[str, Any]:
    """Return the counts with the scene's filter distances, one or both of which may be switched off."""
    contact = {**dict.fromkeys(SETTINGS[case[0]], 0.0), "damping": case[1]}
    return study.once(("socket", *case), lambda: count_false(study.run(socket(contact), "IAPB")))


def _counts(study: Study, case: tuple[str, float]) -> Row:
    found = found_with(study, case)
    return {"filters": case[0], "damping [N s/m]": case[1], **{key: found[key] for key in COUNTED}}


def _times(study: Study, case: tuple[str, float]) -> Iterator[Row]:
    found = found_with(study, case)
    for count, (time, share) in enumerate(zip(found["times"], found["shares"], strict=True), start=1):
        yield {"filters": case[0], "damping [N s/m]": case[1], "time [s]": time, "false collisions so far": count,
               "energy lost so far, share of the fall": share}


def filters(table: Table) -> Part:
    """Return the part on C18 with the scene's filter distances: with both filters, and with each alone."""
    counts = "; ".join(f"{name} {', '.join(map(str, table.where(filters=name)['false collisions']))}"
                       for name in SETTINGS)  # fmt: skip
    both = table.where(filters="both filters")
    left = [f"{row['damping']:g}" for row in both.records() if row["false collisions"]]
    return Part.of(
        "C18: number of false collisions of a ball that rolls in a faceted socket, at contact dampings of "
        f"{', '.join(f'{b:g}' for b in both['damping'])} N s/m. The distances of both filters exceed the "
        f"{1e3 * edge_jump():.1f} mm between contacts on neighbouring facets", f"at these dampings: {counts}",
        "none with both filters",
        REFUTED if len(left) == len(both.rows) else MIXED if left else REPRODUCED,
        miss=f"at a wall damping of {', '.join(left)} N s/m, a ball that rolls over flat facets gets false impulses "
             "despite the paper's two filters" if left else "")  # fmt: skip


IN_TIME = Check(key="false collisions in time", question="When do the false collisions happen?", cases=_cases,
                row=_times)  # fmt: skip
FALSE_COLLISIONS = Check(
    key="false collisions", question="Do the filters remove false collisions?", cases=_cases, row=_counts, says=filters,
    digits=3, note="The ball rolls for two seconds. In a round socket it would have one contact in each step and no "
                   "collision after the first. Doubled contacts: those beyond one per step.",
)  # fmt: skip
