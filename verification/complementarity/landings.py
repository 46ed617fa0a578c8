"""Two impacts to draw: a bar lands on two posts, far apart and close together.

The bar has a mass of 1 kg and a half length of 1 m. Its left contact comes down at 1 m/s, the right
one at r. A push at one contact moves the other by the cosine c of their rows in the kinetic metric.
"""

from __future__ import annotations

import math

import numpy as np

from iapb import resolve_impact
from verification.check import Check, Study
from verification.table import Row

MASS = 1.0
HALF_LENGTH = 1.0
INERTIA = MASS * HALF_LENGTH**2 / 3.0
SPEED_RATIO = 0.25  # r
COSINES = {"A": -0.3, "B": 0.75}
PEG = "peg_corner"


def post_of(cosine: float) -> float:
    """Return the distance of the posts from the middle of the bar [m] that gives the cosine."""
    share = (1.0 - cosine) / (1.0 + cosine)  # of the squared distance by the squared gyration
    return math.sqrt(share * INERTIA / MASS)


def cosine_of(distance: float, mass: float, inertia: float) -> float:
    """Return the cosine of two contacts on a face, each at this distance from the centre's foot."""
    push = 1.0 / mass
    turn = distance**2 / inertia
    return (push - turn) / (push + turn)


def peg_cosine(study: Study) -> float:
    """Return the cosine of the corners of the lower face of the paper's peg."""
    peg = study.scene(PEG).resolved()["bodies"][0]
    return cosine_of(0.5 * peg["shapes"][0]["size"][0], peg["mass"], float(np.max(peg["inertia"])))


def _row(study: Study, name: str) -> Row:
    if name == PEG:
        return {"impact": name, "c": peg_cosine(study)}
    cosine = COSINES[name]
    post = post_of(cosine)
    mass = np.diag([MASS, INERTIA])
    rows = np.array([[1.0, -post], [1.0, post]])  # of the height and the angle of the bar
    v = np.linalg.solve(rows, [-1.0, -SPEED_RATIO])
    formula = resolve_impact(mass, rows, v, 0.0)
    pushed = resolve_impact(mass, rows, v, 0.0, method="poisson")
    return {
        "impact": name,
        "c": cosine,
        "r": SPEED_RATIO,
        "post from the middle [m]": post,
        "impulse at the left [N s]": float(formula.impulses[0]),
        "impulse at the right [N s]": float(formula.impulses[1]),
        "right contact after pushing only [m/s]": float(rows[1] @ pushed.velocity),
    }


LANDINGS = Check(
    key="landings",
    question="What do both laws do to a bar that lands on two posts?",
    cases=lambda study: (*COSINES, PEG),
    row=_row,
)
