"""The rule that turns trials into a verdict, and the words about them."""

import pytest

from verification.claims.claim import Claim, Part, overall
from verification.finding import (
    MIXED,
    NOT_TESTABLE,
    REFUTED,
    REPRODUCED,
    Column,
    table_of,
    verdict_of_trials,
)


@pytest.mark.parametrize(
    ("holds", "verdict"),
    [
        ([True, True, None], REPRODUCED),
        ([True, True, False], MIXED),
        ([True, False], MIXED),
        ([True, False, False], REFUTED),
        ([False], REFUTED),
        ([None, None], NOT_TESTABLE),
        ([], NOT_TESTABLE),
    ],
)
def test_verdict_follows_from_the_trials(holds, verdict):
    assert verdict_of_trials(holds) == verdict


@pytest.mark.parametrize(
    ("verdicts", "verdict"),
    [
        ([REPRODUCED, REPRODUCED, NOT_TESTABLE], REPRODUCED),
        ([REPRODUCED, REFUTED], MIXED),
        ([MIXED, REPRODUCED], MIXED),
        ([REFUTED, REFUTED], REFUTED),
        ([NOT_TESTABLE], NOT_TESTABLE),
    ],
)
def test_a_claim_is_refuted_only_where_no_part_of_it_stands(verdicts, verdict):
    assert overall([Part("", one, 0, 0) for one in verdicts]) == verdict


COLUMNS = (Column("part", part=True), Column("tilt", "rad", condition=True), Column("error"))


def claim():
    return Claim("C99", "", "", "", "", lambda study: None, lambda row: row["error"] < 1.0, lambda table: "")


def concluded(*trials):
    table = table_of(COLUMNS, [dict(zip(("part", "tilt", "error"), trial, strict=True)) for trial in trials])
    return claim().conclude(claim().judge(table))


def test_failures_are_told_apart_by_part_with_their_conditions():
    result = concluded(("x", 0.0, 0.5), ("x", 0.3, 2.0), ("y", 0.0, 0.5), ("y", 0.3, 0.5))
    assert result.verdict == MIXED
    assert result.fails == "x: in 1 of 2 trials, with tilt 0.3 rad"
    assert result.conditions == "tilt 0, 0.3 rad"
    assert (result.held, result.decided) == (3, 4)
    assert result.parts == (Part("x", MIXED, 1, 2), Part("y", REPRODUCED, 2, 2))


def test_a_part_that_never_holds_says_so():
    assert concluded(("x", 0.0, 2.0), ("x", 0.3, 2.0), ("y", 0.0, 0.0)).fails == "x: in all 2 trials"


def test_nothing_is_said_about_failures_where_there_are_none():
    assert concluded(("x", 0.0, 0.5)).fails == ""
