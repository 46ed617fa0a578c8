"""Topic: linkages and free bodies, compared with Pinocchio and conservation laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from verification.check import Topic
from verification.finding import Part
from verification.mechanics.against_pinocchio import AGAINST_PINOCCHIO, IMPULSE_DYNAMICS
from verification.mechanics.definiteness import POSITIVE_DEFINITE
from verification.mechanics.linked_impacts import LINKED_IMPACTS, PER_BODY
from verification.table import Table


def _answer(tables: Mapping[str, Table], _: Sequence[Part]) -> str:
    worst, balls = (
        max(tables[AGAINST_PINOCCHIO.key]["worst"], default=0.0),
        tables[LINKED_IMPACTS.key],
    )
    lost = min(balls.where(treatment=PER_BODY)["momentum change"])
    return (
        f"Mass matrices, forces and Jacobians differ from Pinocchio's by at most {worst:.1e} of "
        f"the largest "
        "entry. (13)-(14) give each of two touching bodies its own impulse: a ball rebounds from "
        "resting balls as "
        f"from a wall, and the total momentum changes by at least {lost:.2g} times its value."
    )


mechanics = Topic(
    key="mechanics",
    title="Linkages and free bodies",
    question="The engine describes free bodies and linkages by generalized coordinates (1)-(3). This page compares its "
    "mechanics with Pinocchio and with conservation laws. It then shows impacts between touching balls.",
    checks=(AGAINST_PINOCCHIO, IMPULSE_DYNAMICS, POSITIVE_DEFINITE, LINKED_IMPACTS),
    says=_answer,
)
