"""The sampled wall: exact between the samples, and the laws of its outcomes."""

from __future__ import annotations

import numpy as np
import pytest

from verification.check import Study
from verification.claims import CLAIMS
from verification.stability import walls as study


def at(loop: study.Loop, stiffness: float, damping: float, law: str):  # type: ignore[no-untyped-def]
    return study.touch_walls(loop, np.array([stiffness]), np.array([damping]), law)


@pytest.mark.parametrize("b", [0.05, 5.0, 500.0])
def test_motion_between_samples_is_that_of_the_differential_equation(b: float) -> None:
    """m x'' = F − b x' with a held F, in closed form."""
    loop = study.Loop(device_damping=b)
    free, moved, held = study._held_force(loop)
    rate = b / loop.mass
    faded = np.exp(-rate * loop.step)
    assert free == pytest.approx(faded, rel=1e-12)
    assert moved == pytest.approx((1.0 - faded) / rate, rel=1e-11)
    assert held == pytest.approx((loop.step - moved) / rate, rel=1e-7)


@pytest.mark.parametrize("law", [study.PENALTY, study.IMPULSES])
def test_a_stiff_undamped_wall_never_settles_and_a_soft_damped_one_does(law: str) -> None:
    assert np.isinf(at(study.Loop(), 1e6, 0.0, law)).all()
    assert np.isfinite(at(study.Loop(device_damping=5.0), 1000.0, 50.0, study.PENALTY)).all()


def test_stiff_walls_at_1_khz_bounce_on_below_the_speed_of_rest() -> None:
    """Such walls do not count as stable, although the mass is slower than the speed of rest."""
    for seconds in (3.0, 12.0):
        loop = study.Loop(rate=1000.0, seconds=seconds)
        assert np.isinf(at(loop, 3e5, 0.0, study.IMPULSES)).all()


def test_a_plastic_impulse_settles_sooner_than_the_paper_s_damping() -> None:
    loop = study.Loop()
    assert at(loop, 1000.0, 50.0, study.IMPULSES) < at(loop, 1000.0, 50.0, study.PENALTY)


def test_c20_holds_and_would_not_with_the_bound_in_the_wrong_place() -> None:
    claim = CLAIMS["C20"]
    device_of_twice_the_bound = [case for case in claim.cases(Study()) if case[2] == 2.0]
    table = claim.table(Study(), device_of_twice_the_bound[:5])
    assert table.passed is True
    moved = [
        dict(row, **{"virtual damping": 2.0 * row["virtual damping"]})
        for row in table.records()
        if row["virtual damping"] == 0.95
    ]
    assert not any(claim.holds(row) for row in moved)
