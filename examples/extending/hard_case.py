"""A hard case: a bead that touches two facing walls at once. Its exact answer is computed in
rationals.

In the project it is an entry of verification/hard_cases/impacts.yaml.

Prints:
    factored stable
    gram_pinv stable
    gram_cholesky refused
"""

import numpy as np

from verification.hard_cases import HARD_CASES, judge_hard_case
from verification.hard_cases.case import HardCase


def bead_between_walls() -> HardCase:
    """Two opposite rows: one wall approaches exactly as fast as the other recedes."""
    return HardCase(
        "A bead between two walls",
        "a tight hole",
        "the rows are opposite: rank one, and impulses of either sign explain the motion",
        "the velocity is reversed once",
        np.array([[0.3]]),
        np.array([[1.0], [-1.0]]),
        np.array([0.7]),
        1.0,
    )


HARD_CASES["bead_between_walls"] = bead_between_walls

for method in ("factored", "gram_pinv", "gram_cholesky"):
    case = HARD_CASES["bead_between_walls"]()
    print(method, judge_hard_case(case, method)["outcome"])
