"""What is said of the hand's port and of the peg follows the rows."""

from __future__ import annotations

import pytest

from verification.check import Study
from verification.finding import MIXED, NOT_TESTABLE, REFUTED, REPRODUCED
from verification.stability import device_port
from verification.stability.device_port import CROSSES, PORT, PRESSES, coordinated, coupled
from verification.stability.peg import PEG, peg

WALL = ("CBuc", 1000.0, 0.0)
BOUND = 0.5 * 1000.0 / 512.0


@pytest.fixture
def leaks(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Rows of made-up loops: damping needed, as a share of the bound."""
    monkeypatch.setitem(device_port.SPEEDS, "quick", (1.0,))
    found = []
    for wall, sensors, kind, needed in (
        (WALL, "ideal", PRESSES, 0.9), (WALL, "ideal", CROSSES, 2.0), (WALL, "late", PRESSES, 4.0),
        (("PB", *WALL[1:]), "ideal", PRESSES, 70.0 / BOUND),
    ):
        monkeypatch.setattr(device_port, "needed_damping", lambda *_, b=needed * BOUND: b)
        found.append(PORT.row(Study(), (wall, sensors, kind)))
    return found


def test_a_pressing_hand_that_needs_more_than_the_bound_refutes_it(leaks) -> None:
    """A hand that crosses the surface needs more than the bound, so that energy comes out at it."""
    assert coupled(PORT.table_of(leaks)).verdict == MIXED
    assert "70 to 70 N s/m" in coordinated(PORT.table_of(leaks)).sentence
    leaks[0]["needed / bound"] = 1.001
    assert coupled(PORT.table_of(leaks)).verdict == REFUTED
    assert leaks[1]["leak at the bound [mJ]"] > 0.0 and 0.0 < leaks[1]["leak / energy exchanged"] < 1.0


@pytest.mark.parametrize(("times", "verdict"), [
    ((2.0, 1.0, 2.0, 2.0), REPRODUCED), ((None, 1.0, 1.0, 2.0), MIXED), ((1.0, 2.0, 1.0, None), REFUTED),
    ((None, None, None, None), NOT_TESTABLE),
])
def test_the_peg_rests_no_later_with_impulses(times, verdict) -> None:
    assert peg(PEG.table_of({"settles after [s]": time, "bounces": 1} for time in times)).verdict == verdict
