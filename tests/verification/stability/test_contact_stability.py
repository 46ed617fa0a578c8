"""What is said of the hand's port and of the peg follows the rows."""

from __future__ import annotations

from dataclasses import replace

import pytest

from verification.finding import MIXED, NOT_TESTABLE, REFUTED, REPRODUCED, table_of
from verification.stability import device_port
from verification.stability.device_loop import DeviceLoop
from verification.stability.device_port import coordinated, coupled
from verification.stability.peg import COLUMNS, peg

LOOP = DeviceLoop("CBuc", 1000.0, 0.0)


@pytest.fixture
def leaks(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Rows of made-up loops: damping needed, as a share of the bound."""
    found = []
    for loop, sensors, kind, needed in (
        (LOOP, "ideal", device_port.PRESSES, 0.9), (LOOP, "ideal", device_port.CROSSES, 2.0),
        (replace(LOOP, delay=1), "late", device_port.PRESSES, 4.0),
        (replace(LOOP, world="PB"), "ideal", device_port.PRESSES, 70.0 / LOOP.bound),
    ):  # fmt: skip
        monkeypatch.setattr(device_port, "needed_damping", lambda *_, b=needed * loop.bound: b)
        found.append(device_port._worst(loop, sensors, kind, (1.0,)))
    return found


def test_the_sentences_say_what_is_needed(leaks) -> None:
    ports = table_of(device_port.COLUMNS, leaks)
    part = coupled(ports)
    assert part.verdict == MIXED
    assert "reaches 0.9000 times" in part.sentence and "up to 4 times" in part.sentence
    assert "out of contact needs up to 2 times" in part.sentence
    assert "70 to 70 N s/m" in coordinated(ports).sentence


def test_a_leak_at_the_bound_refutes_it(leaks) -> None:
    leaks[0]["needed / bound"] = 1.001
    assert coupled(table_of(device_port.COLUMNS, leaks)).verdict == REFUTED


def test_a_leak_is_a_share_of_what_was_turned_over(leaks) -> None:
    """A hand that crosses the surface needs more than the bound, so that energy comes out at it."""
    assert leaks[1]["leak at the bound"] > 0.0 and 0.0 < leaks[1]["leak / energy exchanged"] < 1.0


@pytest.mark.parametrize(("times", "verdict"), [
    ((2.0, 1.0, 2.0, 2.0), REPRODUCED), ((None, 1.0, 1.0, 2.0), MIXED), ((1.0, 2.0, 1.0, None), REFUTED),
    ((None, None, None, None), NOT_TESTABLE),
])  # fmt: skip
def test_the_peg_rests_no_later_with_impulses(times, verdict) -> None:
    rows = [{"settles after": time, "bounces": 1} for time in times]
    assert peg(table_of(COLUMNS, rows)).verdict == verdict
