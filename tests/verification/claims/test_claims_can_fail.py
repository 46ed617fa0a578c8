"""Every judge refutes trials that contradict its claim, and confirms trials that agree with it."""

import numpy as np
import pytest

from verification.claims import CLAIMS
from verification.claims.claim import REFUTED, REPRODUCED
from verification.claims.table import Column, table_of

NEAR, FAR = 1e-4, 1e-3  # [m] or [rad]

# id -> (a trial that agrees, a trial that contradicts)
PLANTED = {
    **{name: ({"error": 1e-15, "bound": 1e-12}, {"error": 0.13, "bound": 1e-12}) for name in ("C01", "C02")},
    **{name: ({"error": 1e-15, "bound": 1e-12}, {"error": np.inf, "bound": 1e-12}) for name in ("C03", "C04")},
    "C05": ({"error": 0.0, "bound": 0.0}, {"error": np.nan, "bound": 1.0}),
    "C10": ({"IAPB": NEAR, "PB": FAR, "CBuc": FAR}, {"IAPB": FAR, "PB": NEAR, "CBuc": FAR}),
}


def judged(claim, trial):
    table = table_of([Column(name) for name in trial], [trial])
    return claim.judge(table)


def test_every_claim_has_planted_trials():
    assert set(PLANTED) == set(CLAIMS)


@pytest.mark.parametrize("name", sorted(PLANTED))
def test_judge_confirms_and_refutes(name):
    from verification.claims.claim import verdict_of

    agrees, contradicts = PLANTED[name]
    assert verdict_of(judged(CLAIMS[name], agrees).holds) == REPRODUCED
    assert verdict_of(judged(CLAIMS[name], contradicts).holds) == REFUTED


def test_a_coordinate_that_nobody_moves_cannot_tell():
    assert CLAIMS["C10"].holds({"IAPB": 1e-9, "PB": 0.0, "CBuc": 2e-9}) is None
