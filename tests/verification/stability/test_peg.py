"""What the peg in the corner says of impulses: it rests no later, and bounces no more often."""

from __future__ import annotations

import pytest

from verification.finding import NOT_TESTABLE, REFUTED, REPRODUCED
from verification.stability.peg import PEG, peg


@pytest.mark.parametrize(
    ("times", "verdict"),
    [
        ((2.0, 1.0, 2.0, 2.0), REPRODUCED),
        ((None, 1.0, 1.0, 2.0), REFUTED),
        ((1.0, 2.0, 1.0, None), REFUTED),
        ((None, None, None, None), NOT_TESTABLE),
    ],
)
def test_the_peg_rests_no_later_with_impulses(times, verdict) -> None:
    rests, bounces = peg(PEG.table_of({"settles after [s]": time, "bounces": 1} for time in times))
    assert rests.verdict == verdict and bounces.verdict == REPRODUCED


def test_more_bounces_with_impulses_are_a_finding_of_their_own() -> None:
    rows = [{"settles after [s]": 1.0, "bounces": bounces} for bounces in (1, 2, 2, 2)]
    rests, bounces = peg(PEG.table_of(rows))
    assert rests.verdict == NOT_TESTABLE  # equally soon
    assert (bounces.verdict, bounces.value) == (REFUTED, 1)
