"""The rule of every claim confirms a row that agrees, refutes one that contradicts, says where a
row cannot tell."""

import re

import pytest

from tests.given import data_of
from verification.claims import CLAIMS, algebraic, peg, socket, walls

MODULES = {"algebraic": algebraic, "peg": peg, "socket": socket, "walls": walls}
GIVEN = data_of(__file__, "rows.yaml")
ROWS = [(claims, row, held) for claims, rows in GIVEN.items() for row, held in rows]


def named(value):
    """A value, or the text of a name such as peg.CLOSEST."""
    if not isinstance(value, str):
        return value
    return re.sub(r"(\w+)\.([A-Z_]+)", lambda name: getattr(MODULES[name[1]], name[2]), value)


def test_a_difference_counts_only_if_all_thresholds_agree_on_its_sign():
    assert [
        peg.agreed(each) for each in ([0.3, 0.1, 0.2], [-0.3, -0.1, -0.2], [0.3, -0.1, 0.2], 0.4)
    ] == [0.1, -0.1, 0.0, 0.4]


@pytest.mark.parametrize(("claims", "row", "held"), ROWS)
def test_the_rule_of_a_claim(claims, row, held):
    row = {key: named(value) for key, value in row.items()}
    assert {CLAIMS[name].holds(row) for name in claims.split()} == {held}


def test_every_claim_can_hold_and_fail():
    for outcome in (True, False):
        assert {
            name for claims, _, held in ROWS if held is outcome for name in claims.split()
        } == set(CLAIMS)
