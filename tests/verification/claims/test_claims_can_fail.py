"""Every judge refutes trials that contradict its claim, and confirms trials that agree with it."""

import numpy as np
import pytest

from verification.claims import CLAIMS, peg, socket
from verification.finding import REFUTED, REPRODUCED, verdict_of_trials

RENDERED = {"saturate": 3e-3, "scale": 2e-3, "spread": 1e-3}
NEAR, FAR = 1e-4, 1e-3  # [m] or [rad]
FILTERED = {
    "part": socket.REACHES, "coherence_distance": 6.0, "speed × step": 1.2,
    "false collisions without filters": 26,
}  # fmt: skip

# id -> (a trial that agrees, a trial that contradicts)
PLANTED = {
    **{name: ({"error": 1e-15, "bound": 1e-12}, {"error": 0.13, "bound": 1e-12}) for name in ("C01", "C02")},
    **{name: ({"error": 1e-15, "bound": 1e-12}, {"error": np.inf, "bound": 1e-12}) for name in ("C03", "C04")},
    **{name: ({"error": 0.0, "bound": 0.0}, {"error": 1e-3, "bound": 0.0}) for name in ("C06", "C08", "C09")},
    "C07": ({"expected": "all", "share lost": 1.0 - 1e-15}, {"expected": "all", "share lost": 0.9}),
    "C11": (
        {"part": peg.CLOSEST, "IAPB": NEAR, "PB": FAR, "CBuc": FAR},
        {"part": peg.CLOSEST, "IAPB": FAR, "PB": FAR, "CBuc": NEAR},
    ),
    "C12": (
        {"part": f"x: {peg.LEAST}", "impacts limited": 0.5} | RENDERED,
        {"part": f"x: {peg.MOST}", "impacts limited": 0.5} | RENDERED | {"scale": 1.0},
    ),
    "C13": (
        {"coordinate": peg.PENETRATION, "IAPB": NEAR, "PB": FAR},
        {"coordinate": peg.PENETRATION, "IAPB": FAR, "PB": NEAR},
    ),
    "C14": ({"coordinate": "x", "IAPB": 15.0, "PB": 5.0}, {"coordinate": "x", "IAPB": 4.0, "PB": 5.0}),
    "C15": (
        {"part": peg.SETTLES, "IAPB": 0.5, "PB": np.inf},
        {"part": peg.SETTLES, "IAPB": np.inf, "PB": 2.0},
    ),
    "C16": (
        {"rendering": "spread", "distance": 0.0, "angle": 1e-15, "impacts limited": 1.0},
        {"rendering": "saturate", "distance": 0.0, "angle": 1e-15, "impacts limited": 1.0},
    ),
    "C17": (
        {"lost": 3e-3, "of the reference": 3e-3},
        {"lost": 3.1e-3, "of the reference": 3e-3},
    ),
    "C18": (FILTERED | {"false collisions": 0}, FILTERED | {"false collisions": 1}),
    "C19": ({"late calls": 1, "contacts": 60}, {"late calls": 2, "contacts": 60}),
    "C20": (
        {"virtual damping": 0.95, "energy from the wall": 0.0, "wall's turnover": 1.0},
        {"virtual damping": 0.95, "energy from the wall": 1e-3, "wall's turnover": 1.0},
    ),
    "C21": (
        {"impulses settle after": 0.1, "penalty settles after": np.inf},
        {"impulses settle after": 0.2, "penalty settles after": 0.1},
    ),
    "C22": (
        {"ratio": 1.3, "lower quartile": 1.11, "upper quartile": 4.0},
        {"ratio": 0.8, "lower quartile": 0.2, "upper quartile": 0.9},
    ),
    "C05": ({"error": 0.0, "bound": 0.0}, {"error": np.nan, "bound": 1.0}),
    "C10": ({"IAPB": NEAR, "PB": FAR, "CBuc": FAR}, {"IAPB": FAR, "PB": NEAR, "CBuc": FAR}),
}


def test_every_claim_has_planted_trials():
    assert set(PLANTED) == set(CLAIMS)


@pytest.mark.parametrize("name", sorted(PLANTED))
def test_judge_confirms_and_refutes(name):
    agrees, contradicts = PLANTED[name]
    assert verdict_of_trials(CLAIMS[name].table_of([agrees]).holds) == REPRODUCED
    assert verdict_of_trials(CLAIMS[name].table_of([contradicts]).holds) == REFUTED


@pytest.mark.parametrize(
    ("name", "trial"),
    [
        ("C07", {"expected": "part", "share lost": 1.0}),
        ("C07", {"expected": "part", "share lost": 0.0}),
        ("C11", {"part": peg.LARGE, "IAPB": 5.0, "PB": 8.0, "CBuc": 8.0}),
        ("C11", {"part": peg.BALANCE, "IAPB": 0.1, "hand": -0.32}),
        ("C15", {"part": peg.FEWER, "IAPB": 2, "PB": 2}),
        ("C15", {"part": peg.NO_MORE, "IAPB": 3, "PB": 2}),
        ("C15", {"part": peg.SETTLES, "IAPB": 1.5, "PB": 1.5}),
        ("C19", {"late calls": 2, "contacts": 30000}),
        ("C13", {"coordinate": "x", "IAPB": FAR, "PB": NEAR, "CBuc": FAR}),
        ("C16", {"rendering": "scale", "distance": 1e-4, "angle": 0.0, "impacts limited": 1.0}),
        ("C20", {"virtual damping": 1.05, "energy from the wall": 0.0, "wall's turnover": 1.0}),
        ("C20", {"virtual damping": None, "energy from the wall": 0.0, "wall's turnover": 1.0}),
        ("C18", FILTERED | {"part": socket.CLUSTERING, "coherence_distance": 0, "false collisions": 41}),
        ("C18", FILTERED | {"part": socket.SHORT, "coherence_distance": 2, "false collisions": 26}),
    ],
)
def test_every_part_of_a_claim_can_fail(name, trial):
    assert CLAIMS[name].holds(trial) is False


@pytest.mark.parametrize(
    ("name", "trial"),
    [
        ("C11", {"part": peg.BALANCE, "IAPB": None, "hand": -0.32}),
        ("C12", {"part": "x", "impacts limited": 0.0} | RENDERED),
        ("C14", {"coordinate": "theta", "IAPB": 1e-9, "PB": 0.0}),
        ("C15", {"part": peg.FEWER, "IAPB": 0, "PB": 0}),
        ("C15", {"part": peg.SETTLES, "IAPB": np.inf, "PB": np.inf}),
        ("C21", {"impulses settle after": np.inf, "penalty settles after": np.inf}),
        ("C16", {"rendering": "scale", "distance": 1e-4, "angle": 0.0, "impacts limited": 0.0}),
        ("C18", FILTERED | {"coherence_distance": 1.0, "false collisions": 26}),
        ("C18", FILTERED | {"false collisions without filters": 0, "false collisions": 0}),
    ],
)
def test_a_trial_that_cannot_tell_says_so(name, trial):
    assert CLAIMS[name].holds(trial) is None


def test_a_coordinate_that_nobody_moves_cannot_tell():
    assert CLAIMS["C10"].holds({"IAPB": 1e-9, "PB": 0.0, "CBuc": 2e-9}) is None
