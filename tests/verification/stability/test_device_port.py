"""The hand's port of whole device loops: the coupler's bound is sharp, and what lies beyond it
leaks; what is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from verification.check import Study
from verification.finding import MIXED, NOT_TESTABLE, REFUTED, REPRODUCED
from verification.stability import device_port as study
from verification.stability.peg import PEG, peg

COUPLED = study.DeviceLoop("CBuc", 1000.0, 0.0)


def needed(loop: study.DeviceLoop, motion: str, share: float) -> float:
    x = study.hand_positions(loop, motion, share)
    return study.needed_damping(x, study.actuator_forces(loop, x), loop.dt) / loop.bound


def test_a_coupler_on_a_rigid_wall_needs_its_bound_and_no_more() -> None:
    assert 0.99 < needed(COUPLED, study.PRESSES, 1.0) <= 1.0 + 1e-12
    assert needed(replace(COUPLED, damping=50.0), study.PRESSES, 1.0) <= 1.0 + 1e-12


def test_the_coordination_is_felt_in_the_hand_too() -> None:
    loop = study.DeviceLoop("PB", 1000.0, 0.0)
    assert needed(loop, study.PRESSES, 1.0) > 10.0
    x = study.hand_positions(loop, study.PRESSES, 1.0)
    share = (
        study.needed_damping(x, study.actuator_forces(loop, x), loop.dt)
        / loop.bound_with_coordination
    )
    assert 0.95 < share < 1.05  # about the sum of the gains, and no bound: the tool moves as well


def test_the_needed_damping_is_the_least_without_a_leak() -> None:
    loop = replace(COUPLED, delay=1)
    x = study.hand_positions(loop, study.PRESSES, 0.05)
    forces = study.actuator_forces(loop, x)
    b = study.needed_damping(x, forces, loop.dt)
    size = b * float(np.sum(np.diff(x) ** 2)) / loop.dt
    assert study.leaked(x, forces, b, loop.dt) < 1e-12 * size
    assert study.leaked(x, forces, 0.99 * b, loop.dt) > 1e-6 * size


def test_in_the_wall_the_coupler_pushes_by_its_gains() -> None:
    loop = replace(COUPLED, damping=20.0)
    x = np.concatenate([np.linspace(-loop.clearance, study.HALF, 40), np.full(5, study.HALF)])
    forces = study.actuator_forces(loop, x)
    assert forces[0] == 0.0  # before it touches
    assert forces[-1] == pytest.approx(-1000.0 * study.HALF, rel=1e-9)
    rate = (x[38] - x[37]) / loop.dt
    assert forces[38] == pytest.approx(-1000.0 * x[38] - 20.0 * rate, rel=1e-9)


def test_sensors_are_coarse_and_late() -> None:
    delay, resolution = study.SENSORS["late and coarse"]
    loop = replace(COUPLED, delay=delay, resolution=resolution)
    device = study.MovedDevice(np.array([0.0, 1.4e-5, 2.6e-5]), loop)
    assert device.read().q[0] == 0.0
    device.apply([1.0])
    assert device.read().q[0] == 0.0  # one step late
    device.apply([2.0])
    reading = device.read()
    assert reading.q[0] == pytest.approx(1e-5, rel=1e-12) and reading.v[0] == pytest.approx(
        1e-5 / loop.dt, rel=1e-12
    )
    assert device.held_forces(delay).tolist() == [0.0, 1.0]


@pytest.fixture
def leaks(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Rows of made-up loops: damping needed, as a share of the bound."""
    monkeypatch.setitem(study.SPEEDS, "quick", (1.0,))
    found = []
    for world, sensors, kind, share in (
        ("CBuc", "ideal", study.PRESSES, 0.9),
        ("CBuc", "ideal", study.CROSSES, 2.0),
        ("CBuc", "late", study.PRESSES, 4.0),
        ("CBuc", "late", study.CROSSES, 5.0),
        ("PB", "ideal", study.PRESSES, 70.0 / COUPLED.bound),
    ):
        monkeypatch.setattr(study, "needed_damping", lambda *_, b=share * COUPLED.bound: b)
        found.append(study.PORT.row(Study(), ((world, 1000.0, 0.0), sensors, kind)))
    return found


def test_a_pressing_hand_that_needs_more_than_the_bound_refutes_it(leaks) -> None:
    """A hand that crosses the surface needs more than the bound, so that energy comes out at it."""
    assert study.coupled(study.PORT.table_of(leaks)).verdict == MIXED
    assert "70 to 70 N s/m" in study.coordinated(study.PORT.table_of(leaks)).sentence
    leaks[0]["needed / bound"] = 1.001
    assert study.coupled(study.PORT.table_of(leaks)).verdict == REFUTED
    assert (
        leaks[1]["leak at the bound [mJ]"] > 0.0 and 0.0 < leaks[1]["leak / energy exchanged"] < 1.0
    )


@pytest.mark.parametrize(
    ("times", "verdict"),
    [
        ((2.0, 1.0, 2.0, 2.0), REPRODUCED),
        ((None, 1.0, 1.0, 2.0), MIXED),
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
    assert (
        rests.verdict == REPRODUCED
        and bounces.verdict == MIXED
        and "in 1 of 2 " in bounces.measured
    )
