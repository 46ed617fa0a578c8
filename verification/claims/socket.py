"""C18: clustering and temporal coherence through space remove false collisions (section III)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from verification.check import Check, Study
from verification.finding import BEYOND
from verification.region import Region
from verification.table import Columns, Row

BOTH = "both filters"
COHERENCE_ALONE = "coherence alone"
CLUSTERING = "clustering alone"
JUMP = "jump of the contact to the next facet"
REACH = "relative coherence distance"
SCENE = "faceted_socket"
SCENE_FACETS = 9
# [m]
RADIUS = 0.2
BALL_RADIUS = 0.02
STEEP = math.radians(70.0)  # [rad] of the ball's start, from the lowest point
LARGEST_SPEED = 1.2445  # [m/s] of a ball that rolls down from there without loss
FACETS = (SCENE_FACETS, 18, 30, 60)  # in a right angle: 10° to 1.5° each
CLUSTER = {
    "quick": (4.0,),
    "full": (4.0, 10.0),
}  # [mm], more than the contacts at an edge are apart
COHERENCE = (1.1, 1.5, 2.0, 3.0, 4.0, 6.0)  # of speed × step
DAMPING = (10.0, 20.0, 60.0)  # [N s/m]
FRESH = 40  # sockets drawn to confirm a region
RATES = {"quick": (1000.0,), "full": (500.0, 1000.0, 2000.0)}  # [Hz]


def edge_jump(facets: int) -> float:
    """Distance [m] between the ball's two contacts at an edge, which is the jump of a contact from
    facet to facet."""
    return 2.0 * BALL_RADIUS * math.sin(0.25 * math.pi / facets)


def socket(contact: Mapping[str, Any], rate: float, facets: int) -> Scene:
    """Return the socket with some contact values changed, at a rate [Hz] and with facets in a right
    angle."""
    values: dict[str, Any] = {f"contact.{name}": value for name, value in contact.items()}
    return _faceted(facets).with_values(values | {"rate": rate})


@cache
def _faceted(facets: int) -> Scene:
    """Return the shipped scene, or the same socket and start with another number of facets in a
    right angle."""
    scene = load_scene(find_scene(SCENE))
    if facets == SCENE_FACETS:
        return scene
    angle = 0.5 * math.pi / facets

    def point(radius: float, number: float) -> list[float]:
        return [radius * math.sin(number * angle), -radius * math.cos(number * angle)]

    corners = (1.0, -0.5), (1.1, -0.5), (1.1, 0.5), (1.0, 0.5)
    walls = [
        {
            "name": f"facet_{number}",
            "kind": "polygon",
            "vertices": [point(RADIUS * out, number + side) for out, side in corners],
        }
        for number in range(-facets, facets + 1)
    ]
    touching = RADIUS * math.cos(0.5 * angle) - BALL_RADIUS + 1e-6  # by a micrometre
    start = point(touching, -round(STEEP / angle))
    return scene.with_values({"walls": walls, "bodies.ball.position": [*start, 0.0]})


def count_false(run: Run) -> int:
    """Count the collisions after the first contact: in a round socket there is none."""
    first = int(np.flatnonzero(np.diff(run.contacts.offsets))[0])
    return int(np.sum(run.impacts.step > first))


class Socket(NamedTuple):
    """A ball in the socket: facets, rate [Hz], damping [N s/m], and filter distances [mm] and [of
    speed × step]."""

    facets: int
    rate: float
    damping: float
    cluster: float
    coherence: float

    @property
    def conditions(self) -> Row:
        """The conditions as cells of a row."""
        jump = edge_jump(self.facets) * self.rate / LARGEST_SPEED
        return {
            f"{JUMP} [times speed × step]": jump,
            "coherence distance [times speed × step]": self.coherence,
            f"{REACH} [times (jump + speed × step)]": self.coherence / (1.0 + jump),
            "cluster distance [mm]": self.cluster,
            "damping [N s/m]": self.damping,
            "rate [Hz]": self.rate,
        }


def _cases(study: Study) -> list[Socket]:
    """Return both filters with every pair of distances, and each filter alone, at every facet,
    damping and rate."""
    filters = [
        *product(CLUSTER[study.depth], COHERENCE),
        *product([0.0], COHERENCE[2:5:2]),
        *product(CLUSTER[study.depth], [0.0]),
    ]
    return [
        Socket(*case, *pair)
        for case in product(FACETS, RATES[study.depth], DAMPING)
        for pair in filters
    ]


def _draw(study: Study, region: Region) -> list[Socket]:
    """Draw fresh sockets with both filters, each condition uniformly in its range, and return those
    in the region."""
    rng = np.random.default_rng(study.seed)
    ranges = RATES[study.depth], DAMPING, CLUSTER[study.depth], COHERENCE
    drawn = [
        Socket(
            int(rng.integers(FACETS[0], FACETS[-1] + 1)),
            *(float(f"{rng.uniform(min(each), max(each)):.4g}") for each in ranges),
        )
        for _ in range(FRESH)
    ]
    return [
        case
        for case in drawn
        if region.contains(
            {title.split(" [")[0]: value for title, value in case.conditions.items()}
        )
    ]


def _row(study: Study, case: Socket) -> Row:
    """Compare the ball with these filters to the ball without filters."""
    plain, filtered = (
        _found(study, each) for each in (case._replace(cluster=0.0, coherence=0.0), case)
    )
    return {
        "part": COHERENCE_ALONE if not case.cluster else BOTH if case.coherence else CLUSTERING,
        **case.conditions,
        "false collisions without filters": plain,
        "false collisions": filtered,
    }


def _found(study: Study, case: Socket) -> int:
    contact = {
        "damping": case.damping,
        "cluster_distance": 1e-3 * case.cluster,
        "coherence_distance": case.coherence * LARGEST_SPEED / case.rate,
    }
    return study.once(
        ("socket", case),
        lambda: count_false(study.run(socket(contact, case.rate, case.facets), "IAPB", "full")),
    )


def _holds(row: Row) -> bool | None:
    """Return whether no false collision remains; None if there is none without filters."""
    if not row["false collisions without filters"]:
        return None
    return bool(row["false collisions"] == 0)


C18 = Check(
    key="C18",
    question="Clustering and temporal coherence remove false collisions.",
    cases=_cases,
    row=_row,
    draw=_draw,
    columns=Columns(
        parts=("part",),
        conditions=(JUMP, "coherence distance", REACH, "cluster distance", "damping", "rate"),
    ),
    holds=_holds,
    roles={COHERENCE_ALONE: BEYOND, CLUSTERING: BEYOND},
)
