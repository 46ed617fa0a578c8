"""The map: agreement with complementarity by geometry, restitution and redundancy; and two contacts, exactly.

For two contacts whose unit rows have the cosine c in the kinetic metric and close at speeds 1 and r <= 1, both
impulses of IAPB push if and only if r >= c: W⁻¹ applied to (1, r) is proportional to (1 − c r, r − c). Below that line
the slower contact pulls. Restitution and all other motion play no part. The map tries this on a grid.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from verification.complementarity.agreement import REPRODUCED, SAME, Comparison, compare_case
from verification.complementarity.cases import two_contacts
from verification.finding import Failure, attempt

COSINES = (-0.9, -0.6, -0.3, 0.0, 0.15, 0.35, 0.55, 0.75, 0.9)
SPEED_RATIOS = (0.05, 0.25, 0.45, 0.65, 0.85, 1.0)
ARTEFACT, ADHESIVE = "artefact of the minimum norm", "adhesive"


@dataclass(frozen=True)
class MapCell:
    """All comparisons with one family, restitution, redundancy and law.

    agree : share whose motions are one; adhesive, artefact : shares whose impulses truly pull, or only as chosen
    nearest : least distance among those that differ (how sharp the border is), farthest : largest of all
    typical : median distance among those that differ
    extra_loss, least_extra_loss : largest and least share of KE⁻ that IAPB loses in addition
    left_approaching, left_approaching_law : share with a contact (given or touching) left approaching
    contradictions : cases in which the motions are one without a p >= 0 for it, or the other way round
    defect : largest defect of statements 1 and 3 (`agreement`), momentum : largest momentum residual
    """

    family: str
    law: str
    restitution: float
    redundancy: int
    cases: int
    agree: float
    adhesive: float
    artefact: float
    adhesive_share: float
    nearest: float
    typical: float
    farthest: float
    extra_loss: float
    least_extra_loss: float
    left_approaching: float
    left_approaching_law: float
    contradictions: int
    defect: float
    momentum: float


@dataclass(frozen=True)
class TwoContactCell:
    """Cosine of the rows and speed ratio: predicted agreement (r >= c), found agreement, distance of the motions."""

    cosine: float
    speed_ratio: float
    predicted: bool
    found: bool
    distance: float


def agreement_map(comparisons: Iterable[Comparison]) -> tuple[MapCell, ...]:
    """Group comparisons by family, law, restitution and redundancy."""
    groups: dict[tuple[str, str, float, int], list[Comparison]] = {}
    for found in comparisons:
        groups.setdefault((found.family, found.law, found.restitution, found.redundancy), []).append(found)
    return tuple(_cell(key, members) for key, members in groups.items())


def _cell(key: tuple[str, str, float, int], members: Sequence[Comparison]) -> MapCell:
    family, law, restitution, redundancy = key
    apart = [m.distance for m in members if not m.agrees]
    newton = law == "newton_lcp"
    return MapCell(
        family, law, restitution, redundancy, len(members),
        agree=_share(m.agrees for m in members),
        adhesive=_share(m.adhesion == ADHESIVE for m in members),
        artefact=_share(m.adhesion == ARTEFACT for m in members),
        adhesive_share=float(np.mean([m.adhesive_share for m in members])),
        nearest=min(apart, default=np.nan), typical=float(np.median(apart)) if apart else np.nan,
        farthest=max(m.distance for m in members),
        extra_loss=max(m.energy_lost - m.energy_lost_law for m in members),
        least_extra_loss=min(m.energy_lost - m.energy_lost_law for m in members),
        left_approaching=_share(m.approaching > 0 for m in members),
        left_approaching_law=_share(m.approaching_law > 0 for m in members),
        contradictions=sum(contradicts(m) for m in members) if newton else 0,
        defect=max(max(m.projection_defect, m.energy_defect) for m in members) if newton else np.nan,
        momentum=max(m.momentum_residual for m in members),
    )  # fmt: skip


def contradicts(found: Comparison) -> bool:
    """Whether a case speaks against "equal motions if and only if some p >= 0 gives IAPB's motion"."""
    return (found.distance <= SAME and found.cone_distance > REPRODUCED) or (
        found.cone_distance <= SAME and found.distance > REPRODUCED
    )


def _share(outcomes: Iterable[bool]) -> float:
    return float(np.mean([bool(outcome) for outcome in outcomes]))


def two_contact_map(
    cosines: Sequence[float] = COSINES, speed_ratios: Sequence[float] = SPEED_RATIOS, seed: int = 2,
    failures: list[Failure] | None = None,
) -> tuple[TwoContactCell, ...]:
    """Try the border r = c on a grid of two-contact impacts; grid points on the border itself are left out."""
    rng = np.random.default_rng(seed)
    cells = []
    for cosine in cosines:
        for ratio in speed_ratios:
            if cosine == ratio:
                continue
            case = two_contacts(cosine, ratio, rng)
            name = f"two contacts, cosine {cosine:g}, speed ratio {ratio:g}"
            found = attempt(name, partial(compare_case, case), failures)
            if found is not None:
                cells.append(TwoContactCell(cosine, ratio, ratio >= cosine, found.agrees, found.distance))
    return tuple(cells)
