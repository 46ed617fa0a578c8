"""The sampled wall: exact between the samples, and the laws of its outcomes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from verification.check import Study
from verification.claims import CLAIMS
from verification.stability import walls as study


def at(loop: study.Loop, stiffness: float, damping: float, law: str):  # type: ignore[no-untyped-def]
    return study.touch_walls(loop, np.array([stiffness]), np.array([damping]), law)


@pytest.mark.parametrize("b", [0.0, 1e-9, 0.05, 5.0, 500.0])
def test_motion_between_samples_is_that_of_the_differential_equation(b: float) -> None:
    """m x'' = F − b x' with a held F: the exponential of its matrix."""
    loop = study.Loop(device_damping=b)
    free, moved, held = study._held_force(loop)
    motion = np.array([[0.0, 1.0, 0.0], [0.0, -b / loop.mass, 1.0], [0.0, 0.0, 0.0]])
    exact = expm(motion * loop.step)
    assert exact[0, 1:] == pytest.approx([moved, held], rel=1e-12)
    assert exact[1, 1:] == pytest.approx([free, moved], rel=1e-12)


@pytest.mark.parametrize("law", study.LAWS)
def test_a_stiff_undamped_wall_makes_the_hand_faster_and_a_soft_damped_one_holds(law: str) -> None:
    assert at(study.Loop(), 1e6, 0.0, law).grown.all()
    assert at(study.Loop(device_damping=5.0), 1000.0, 50.0, study.PENALTY).settled.all()


def test_stiff_walls_at_1_khz_bounce_on_below_the_speed_of_rest() -> None:
    """Such walls do not count as stable, although the mass is slower than the speed of rest."""
    short, long = (
        at(study.Loop(rate=1000.0, seconds=seconds), 3e5, 0.0, study.IMPULSES)
        for seconds in (3.0, 12.0)
    )
    for one in (short, long):
        assert (one.outcomes == study.BOUNCES_ON).all() and np.isinf(one.settles_after).all()


def test_a_plastic_impulse_stops_the_mass_on_touching() -> None:
    loop = study.Loop(push=0.0)
    contact = at(loop, 1000.0, 50.0, study.IMPULSES)
    assert contact.penetration[0] <= 2.0 * loop.speed * loop.step
    assert at(loop, 1000.0, 50.0, study.PENALTY).penetration[0] > 3.0 * contact.penetration[0]


def test_rate_hardness_of_an_impulse_does_not_know_the_wall() -> None:
    stiffness = np.array([100.0, 1e4])
    hardness = study.touch_walls(
        study.Loop(), stiffness, np.array([50.0, 50.0]), study.IMPULSES
    ).rate_hardness
    assert hardness[0] == pytest.approx(hardness[1], rel=1e-12)
    theirs = study.touch_walls(
        study.Loop(), stiffness, np.array([50.0, 50.0]), study.PENALTY
    ).rate_hardness
    assert theirs[1] > theirs[0]


@pytest.mark.parametrize("law", study.LAWS)
def test_no_wall_within_the_condition_makes_the_hand_faster(law: str) -> None:
    loop = study.Loop(device_damping=5.0)
    (stiffness, damping) = study.grid("quick")
    outcomes = study.maps_of(loop, stiffness, damping)[study.LAWS.index(law)].outcomes
    passive = loop.passive_damping(stiffness) >= damping[:, None]
    if law == study.PENALTY:
        assert passive.any() and not (outcomes[passive] == study.GROWS).any()
    assert (outcomes[~passive] == study.GROWS).any()


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
