"""C18: a ball rolls in a faceted socket; its false collisions, with and without the two filters.

In the round socket that the facets stand for, the ball would touch once and never collide again. So every collision
after the first contact is false, and every contact beyond one per step is doubled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import Scene
from verification.finding import Failure, of_each

DAMPINGS = (10.0, 40.0, 60.0)  # B of (5) [N s/m]: from a ball that bounces at edges to one that does not
SCENE = "faceted_socket"
BALL_RADIUS, FACET_ANGLE = 0.02, math.radians(10.0)  # [m], [rad] of the scene
# Distance [m] of the ball's two contacts at an edge: how far a contact jumps from facet to facet.
EDGE_JUMP = 2.0 * BALL_RADIUS * math.sin(0.5 * FACET_ANGLE)
SETTINGS = {
    "no filter": (False, False), "coherence alone": (False, True),
    "clustering alone": (True, False), "both filters": (True, True),
}  # fmt: skip

Simulate = Callable[[Scene], Run]


@dataclass(frozen=True)
class FalseCollisions:
    """One run of the socket.

    clustering, coherence : whether the filter is on; damping : B [N s/m]
    collisions : impacts after the first contact; new_contacts : contacts taken as new, the first left out
    doubled : contacts beyond one per step; lifted : steps off the facets, after the first contact
    energy_lost : [J] in those collisions; potential_drop : [J] from the start to the lowest point, to compare with
    largest_speed : [m/s] of the ball's centre
    times, losses : when each false collision happened [s], and what was lost in it [J]
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
    dampings: Sequence[float] = DAMPINGS, simulate: Simulate | None = None, failures: list[Failure] | None = None
) -> tuple[FalseCollisions, ...]:
    """Return the counts for each damping and each of the four settings of the filters, at the scene's distances."""

    def found(case: tuple[float, str]) -> list[FalseCollisions]:
        damping, setting = case
        return [count_false(socket(_switched_off(SETTINGS[setting]) | {"damping": damping}), simulate)]

    return tuple(of_each(product(dampings, SETTINGS), found, failures, lambda case: f"{case[1]}, {case[0]:g} N s/m"))


def _switched_off(filters: tuple[bool, bool]) -> dict[str, float]:
    names = ("cluster_distance", "coherence_distance")
    return {name: 0.0 for name, kept in zip(names, filters, strict=True) if not kept}


def socket(contact: Mapping[str, Any], rate: float | None = None) -> Scene:
    """The scene with some of its contact's values changed, and its rate [Hz]."""
    from iapb.scene import find_scene, load_scene

    values: dict[str, Any] = {f"contact.{name}": value for name, value in contact.items()}
    return load_scene(find_scene(SCENE)).with_values(values if rate is None else values | {"rate": rate})


def count_false(scene: Scene, simulate: Simulate | None = None) -> FalseCollisions:
    """Simulate the socket and count."""
    run, contact = (simulate or _simulated)(scene), scene.contact
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


def _simulated(scene: Scene) -> Run:
    from iapb.simulation import simulate

    return simulate(scene)
