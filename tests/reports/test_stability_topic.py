"""The hand's port in the stability topic: the table has every loop, and the sentence follows the numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from reports.evidence.stability import _coordinated, _coupled, _ports
from verification.finding import LIMITED, REFUTED
from verification.stability.device_loop import DeviceLoop
from verification.stability.device_port import CROSSES, PRESSES, PortLeak

LOOP = DeviceLoop("CBuc", 1000.0, 0.0)
PORTS = (
    PortLeak(LOOP, "ideal", PRESSES, 0.9 * LOOP.bound, 0.0, 0.2),
    PortLeak(LOOP, "ideal", CROSSES, 2.0 * LOOP.bound, 0.05, 0.2),
    PortLeak(replace(LOOP, delay=1), "late", PRESSES, 4.0 * LOOP.bound, 0.01, 0.2),
    PortLeak(replace(LOOP, world="PB"), "ideal", PRESSES, 70.0, 1.0, 2.0),
)


def test_every_loop_has_its_row() -> None:
    table = _ports(PORTS)
    assert len(table.rows) == len(PORTS) and all(len(row) == len(table.columns) for row in table.rows)
    assert table.rows[1][-3:] == (2.0, 50.0, 0.25)


def test_the_sentence_says_what_is_needed() -> None:
    finding = _coupled(PORTS)
    assert finding.verdict == LIMITED
    assert "needs 0.9000" in finding.sentence and "up to 4 " in finding.sentence and "contact 2:" in finding.sentence
    assert "70 to 70 N s/m" in _coordinated(PORTS).sentence


def test_a_leak_at_the_bound_refutes_it() -> None:
    leaking = replace(PORTS[0], needed=1.001 * LOOP.bound)
    assert _coupled((leaking, *PORTS[1:])).verdict == REFUTED


def test_the_ratio_is_the_damping_over_the_bound() -> None:
    assert PORTS[2].ratio == pytest.approx(4.0, rel=1e-15)
