"""The rule of every claim confirms a row that agrees, refutes one that contradicts, says where a
row cannot tell."""

import numpy as np
import pytest

from verification.claims import CLAIMS, algebraic, peg, socket, walls

TOWARDS = {"part": peg.CLOSEST, "coordinate": "x", "PB": 0.05, "CBuc": 0.06}
RENDERED = {"measure": "x", "ahead": 3e-5, "impacts limited": 0.5}
TOGETHER = {"distance": 0.0, "angle": 1e-15, "impacts limited": 1.0}
SETTLED = {"test": walls.SETTLES, "impulses settle after": 0.2}
LOSS = {"part": algebraic.WITH_HALF, "restitution": 0.5}
AHEAD = {"part": peg.SETTLES, "ahead": 0.4, "ahead, limited": 0.4}
# [m] or [rad]
NEAR = 1e-4
FAR = 1e-3
MOVED = {"part": algebraic.ALMOST, "apart": 1e-12, "turned apart": 0.0, "bound": 1e-11}
BEST = {"IAPB": NEAR, "PB": FAR, "CBuc": FAR}
WORST = {"IAPB": FAR, "PB": NEAR, "CBuc": FAR}
BEST["part"] = WORST["part"] = ""
PUSHED = BEST | {"part": f"{peg.NEARER}, x"}
FILTERED = {"part": socket.BOTH, "false collisions without filters": 26, "false collisions": 1}
LEAKS = {"hand draws energy": True}
TIGHT = {"hand draws energy": False}

# claims -> a row, and what the rule says of it
TIMED = {"ratio": 0.5, "apart": 0.0}
ROWS = [
    ("C01 C02 C03 C04 C05 C06 C08", LOSS | {"error": 1e-12, "bound": 1e-12}, True),
    ("C01 C02 C03 C04 C05 C06 C08", LOSS | {"error": np.inf, "bound": 1e-12}, False),
    ("C01 C02", LOSS | {"error": 0.1, "bound": 0.2}, None),
    ("C01 C02", LOSS | {"error": 0.0, "bound": 1e-12, "restitution": 1.0}, None),
    ("C01 C02", LOSS | {"error": 0.1, "bound": 1e-12, "restitution": 1.0}, False),
    ("C07", {"expected": "all", "share lost": 1.0 - 1e-15}, True),
    ("C07", {"expected": "all", "share lost": 0.9}, False),
    ("C07", {"expected": "part", "share lost": 0.9}, True),
    ("C07", {"expected": "part", "share lost": 1.0}, False),
    ("C09", {"part": algebraic.RESOLVER, "error": 0.0}, True),
    ("C09", {"part": algebraic.RESOLVER, "error": 1e-18}, False),
    ("C09", MOVED, True),
    ("C09", MOVED | {"turned apart": 1e-9}, False),
    ("C10", PUSHED | {"coordinate": "x", "IAPB-push": 5e-5}, True),
    ("C10", PUSHED | {"coordinate": "x", "IAPB-push": FAR}, False),
    ("C10", PUSHED | {"coordinate": "x", "IAPB-push": NEAR}, None),
    ("C10 C13", BEST | {"coordinate": "x"}, True),
    ("C10 C13", WORST | {"coordinate": "x"}, False),
    ("C10 C13", BEST | {"coordinate": "x", "IAPB": FAR - 2e-5}, None),
    ("C10 C13", BEST | {"coordinate": "rotation", "PB": 5e-3}, None),
    ("C11", TOWARDS | {"IAPB": 0.01}, True),
    ("C11", TOWARDS | {"IAPB": 0.09}, False),
    ("C11", TOWARDS | {"IAPB": 0.047}, None),
    ("C11", {"part": peg.BALANCE, "IAPB": 0.1, "PB": 0.02, "CBuc": 0.5}, False),
    ("C12", RENDERED, True),
    ("C12", RENDERED | {"ahead": -3e-5}, False),
    ("C12", RENDERED | {"impacts limited": 0.0}, None),
    ("C13", {"coordinate": peg.PENETRATION, "IAPB": NEAR, "PB": FAR}, True),
    ("C13", {"coordinate": peg.PENETRATION, "IAPB": FAR, "PB": NEAR}, False),
    ("C14", {"coordinate": "x", "IAPB": 15.0, "PB": 5.0}, True),
    ("C14", {"coordinate": "x", "IAPB": 4.0, "PB": 5.0}, False),
    ("C14", {"coordinate": "x", "IAPB": 4.5, "PB": 4.5}, None),
    ("C15", AHEAD, True),
    ("C15", AHEAD | {"ahead, limited": -0.4}, False),
    ("C15", AHEAD | {"ahead": 1e-3, "ahead, limited": 0.0}, None),
    ("C15", AHEAD | {"part": peg.FEWER, "ahead": 1.0, "ahead, limited": -1.0}, False),
    ("C16", TOGETHER | {"rendering": "spread"}, True),
    ("C16", TOGETHER | {"rendering": "saturate"}, False),
    ("C16", TOGETHER | {"rendering": "scale", "distance": 1e-4}, False),
    ("C16", TOGETHER | {"rendering": "scale", "distance": 1e-4, "impacts limited": 0.0}, None),
    ("C17", {"impacts": 4, "error": 1e-15}, True),
    ("C17", {"impacts": 4, "error": 1e-9}, False),
    ("C18", FILTERED | {"false collisions": 0}, True),
    ("C18", FILTERED, False),
    ("C18", FILTERED | {"false collisions without filters": 0, "false collisions": 0}, None),
    ("C19", {"late calls": 1, "contacts": 60}, True),
    ("C19", {"late calls": 2, "contacts": 60}, False),
    ("C20", TIGHT | {"virtual damping": 0.95}, True),
    ("C20", LEAKS | {"virtual damping": 0.95}, False),
    ("C20", TIGHT | {"virtual damping": 1.05}, False),
    ("C21", SETTLED | {"penalty settles after": np.inf, "test": walls.SOONER}, True),
    ("C21", SETTLED | {"penalty settles after": 0.1, "test": walls.SOONER}, False),
    ("C21", SETTLED | {"penalty settles after": 0.2, "test": walls.SOONER}, None),
    ("C21", SETTLED | {"impulses settle after": np.inf, "penalty settles after": 0.1}, False),
    ("C21", SETTLED | {"penalty settles after": np.inf}, None),
    ("C22", TIMED | {"lower quartile": 0.2, "upper quartile": 0.9}, True),
    ("C22", TIMED | {"lower quartile": 0.2, "upper quartile": 0.92}, None),
    ("C22", TIMED | {"lower quartile": 1.11, "upper quartile": 4.0}, False),
    ("C22", TIMED | {"lower quartile": 0.2, "upper quartile": 0.9, "apart": 1e-3}, None),
    ("C22", {"solver alone": 9.0, "IAPB, slowest": 8.0, "IAPB": 2.0, "time": 99.0}, True),
    ("C22", {"solver alone": 0.5, "IAPB, slowest": 8.0, "IAPB": 2.0, "time": 1.0}, False),
]


def test_a_difference_counts_only_if_all_thresholds_agree_on_its_sign():
    assert [
        peg.agreed(each) for each in ([0.3, 0.1, 0.2], [-0.3, -0.1, -0.2], [0.3, -0.1, 0.2], 0.4)
    ] == [0.1, -0.1, 0.0, 0.4]


@pytest.mark.parametrize(("claims", "row", "held"), ROWS)
def test_the_rule_of_a_claim(claims, row, held):
    assert {CLAIMS[name].holds(row) for name in claims.split()} == {held}


def test_every_claim_can_hold_and_fail():
    for outcome in (True, False):
        assert {
            name for claims, _, held in ROWS if held is outcome for name in claims.split()
        } == set(CLAIMS)
