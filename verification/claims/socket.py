"""C18: clustering and temporal coherence through space remove false collisions (section III)."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from verification.check import Check, Study
from verification.finding import BEYOND
from verification.mechanics.false_collisions import EDGE_JUMP, count_false, socket
from verification.region import Region
from verification.table import Row, Table

REACHES = "coherence distance that reaches the contact on the next facet (our condition)"
SHORT = "coherence distance above speed × step (the paper's condition) that does not reach the next facet"
CLUSTERING = "clustering alone"
CLUSTER = {"quick": (0.0, 4.0, 6.0), "full": (0.0, 2.0, 4.0, 6.0, 10.0)}  # [mm]
COHERENCE = {"quick": (0.0, 1.0, 2.0, 4.0, 6.0, 10.0), "full": (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)}  # [mm]
DAMPING = (10.0, 20.0, 40.0, 60.0)  # [N s/m]
FRESH = 40  # sockets drawn to confirm a region; each part uses those that belong to it
RATES = {"quick": (1000.0,), "full": (500.0, 1000.0, 2000.0)}  # [Hz]


class Socket(NamedTuple):
    """A ball in the socket: rate [Hz], contact damping [N s/m], and the distances of the two filters [mm]."""

    rate: float
    damping: float
    cluster: float
    coherence: float


def _cases(study: Study) -> list[Socket]:
    """Every pair of filter distances with at least one filter, at every damping and rate."""
    depth = study.depth
    every = (Socket(*case) for case in product(RATES[depth], DAMPING, CLUSTER[depth], COHERENCE[depth]))
    return [case for case in every if case.cluster or case.coherence]


def _draw(study: Study, region: Region) -> list[Socket]:
    """Draw fresh sockets, each condition uniformly between the ends of the region."""
    rng, depth = np.random.default_rng(study.seed), study.depth
    ends = (region.ends("rate", RATES[depth]), region.ends("damping", DAMPING),
            region.ends("cluster_distance", CLUSTER[depth]), region.ends("coherence_distance", COHERENCE[depth]))
    return [Socket(*(float(f"{rng.uniform(*each):.4g}") for each in ends)) for _ in range(FRESH)]


def _row(study: Study, case: Socket) -> dict[str, Any]:
    """Compare the ball with these filters to the ball without filters."""
    plain, filtered = (_found(study, each) for each in (case._replace(cluster=0.0, coherence=0.0), case))
    travel = 1e3 * filtered["largest speed"] / case.rate
    part = REACHES if case.coherence > 1e3 * EDGE_JUMP + travel else SHORT
    return {
        "part": part if case.coherence else CLUSTERING, "cluster_distance [mm]": case.cluster,
        "coherence_distance [mm]": case.coherence, "damping [N s/m]": case.damping, "rate [Hz]": case.rate,
        "speed × step [mm]": travel,
        "false collisions without filters": plain["false collisions"], "false collisions": filtered["false collisions"],
        "doubled contacts without filters": plain["doubled contacts"], "doubled contacts": filtered["doubled contacts"],
        "steps off the facets": filtered["steps off the facets"],
        "energy lost in them [of the fall]": filtered["energy lost, share of the fall"],
    }  # fmt: skip


def _found(study: Study, case: Socket) -> dict[str, Any]:
    distances = {"cluster_distance": 1e-3 * case.cluster, "coherence_distance": 1e-3 * case.coherence}
    return study.once(("socket", case), lambda: count_false(
        study.run(socket(distances | {"damping": case.damping}, case.rate), "IAPB", "full")))


def _holds(row: Row) -> bool | None:
    """Return whether no false collision remains; None if there was none, or if the paper's condition is not met."""
    if row["false collisions without filters"] == 0:
        return None
    if row["part"] != CLUSTERING and row["coherence_distance"] <= row["speed × step"]:
        return None
    return bool(row["false collisions"] == 0)


def _says(table: Table) -> str:
    clustering = table.where(part=CLUSTERING)
    collisions, unfiltered, doubled, all_contacts = (
        sorted(clustering.column(f"{kind}{without}"))[len(clustering.rows) // 2] if clustering.rows else "no"
        for kind in ("false collisions", "doubled contacts") for without in ("", " without filters"))
    return (
        "Temporal coherence removes false collisions only if its distance reaches the contact on the next facet, "
        f"{1e3 * EDGE_JUMP:.1f} mm away{_bouncing(table.where(part=REACHES).that(False))}. With clustering alone the "
        f"remaining contact jumps from facet to facet and is new each time: the median is {collisions} false "
        f"collisions, against {unfiltered} without any filter. Clustering removes duplicate contacts: the median is "
        f"{doubled}, against {all_contacts} without it."
    )  # fmt: skip


def _bouncing(failures: Table) -> str:
    """Return where a sufficient distance fails, and the number of these trials in which the ball left the facets."""
    if not failures.rows:
        return ""
    off = sum(steps > 0 for steps in failures.column("steps off the facets"))
    where = ", ".join(f"{value:g}" for value in sorted(set(failures.column("damping"))))
    return (f". Even then it fails in {len(failures.rows)} trials (contact damping {where} N s/m): in {off} of them "
            "the ball bounces off the facets at the edges, and each return is a new contact")  # fmt: skip


C18 = Check(
    key="C18", question="Clustering and temporal coherence remove false collisions.", place="Section III",
    quantity="Number of collisions after the first contact of a ball that rolls in a faceted socket. The "
    "facets approximate a round socket, in which a rolling ball does not collide again; so each collision is false.",
    tolerance="No false collision remains. The paper requires a coherence distance above speed × step; a trial with "
    "less cannot tell.",
    cases=_cases, row=_row, holds=_holds, says=_says, draw=_draw, parts=["part"],
    roles={CLUSTERING: BEYOND}, named={SHORT: "coherence distances that do not reach the next facet"},
    conditions=["cluster_distance", "coherence_distance", "damping", "rate"],
    axes=("cluster_distance", "coherence_distance", "damping"),
)  # fmt: skip
