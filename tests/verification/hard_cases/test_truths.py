"""The truths of the hard cases, against laws that are known by hand."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from verification.hard_cases import HARD_CASES, HardCase, TrajectoryCase, judge_hard_case
from verification.hard_cases.chatter import exact_height
from verification.hard_cases.frictional import FrictionalCase
from verification.hard_cases.poisson import exact_poisson


def _impact(name: str) -> HardCase:
    case = HARD_CASES[name]()
    assert isinstance(case, HardCase)
    return case


def _energy(case: HardCase, velocity: tuple[Fraction, ...]) -> Fraction:
    d = len(velocity)
    mass = [[Fraction(x) for x in row] for row in case.mass_matrix]
    return sum((velocity[i] * mass[i][j] * velocity[j] for i in range(d) for j in range(d)), Fraction(0)) / 2


def test_the_face_keeps_its_sliding_exactly() -> None:
    truth = _impact("face_at_three_points").truth
    tangent = (Fraction(4, 5), Fraction(3, 5))
    sliding = tangent[0] * truth.velocity[0] + tangent[1] * truth.velocity[1]
    assert abs(sliding - 3) < Fraction(1, 10**14)  # the velocity itself is given in doubles
    assert truth.rank == 2


def test_the_wedged_peg_is_stopped_exactly() -> None:
    truth = _impact("wedged_peg").truth
    assert truth.rank == 3
    assert truth.velocity == (0, 0, 0)


def test_poissons_law_on_the_bar() -> None:
    """Contact 1 alone stops and returns the bar: p_c = 1/(1 + 3) each way, by hand."""
    case = _impact("bar_with_unequal_restitution")
    mass = np.array([[Fraction(1), 0], [0, Fraction(1, 12)]], dtype=object)
    velocity, pushing = exact_poisson(mass, [[1, Fraction(1, 2)], [1, Fraction(2, 5)]], [-1, 0], [1, 0])
    before = Fraction(1, 2)
    after = (velocity[0] ** 2 + velocity[1] ** 2 / 12) / 2
    assert after <= before
    assert velocity[0] + velocity[1] / 2 >= 0 and velocity[0] + 2 * velocity[1] / 5 >= 0
    assert pushing >= 1 and case.truth.rank == pushing


def test_the_truth_of_equal_restitution_is_the_same_by_either_law() -> None:
    """One contact: Poisson's law is Newton's."""
    velocity, _ = exact_poisson([[2]], [[1]], [-3], [Fraction(1, 2)])
    assert velocity == (Fraction(3, 2),)


def test_friction_meets_restitution_exactly_and_gives_the_energy_back_to_the_certified_digit() -> None:
    case = _impact("double_pendulum_with_friction")
    assert isinstance(case, FrictionalCase)
    row = [Fraction(x) for x in case.contact_jacobian[0]]
    before = tuple(Fraction(x) for x in case.velocity)
    for after in (case.truth.velocity, case.newton_with_coulomb()):
        speeds = [sum((a * x for a, x in zip(row, v, strict=True)), Fraction(0)) for v in (before, after)]
        assert speeds[1] == -Fraction(case.restitution) * speeds[0]
    gain = _energy(case, case.truth.velocity) - _energy(case, before)
    assert abs(gain) < Fraction(1, 10**100)  # the clamp is active, so all is kept
    assert _energy(case, case.newton_with_coulomb()) > 3 * _energy(case, before)


@pytest.mark.parametrize("bounce", [0, 1, 2, 5])
def test_the_chattering_ball_reaches_a_quarter_of_the_height_each_time(bounce: int) -> None:
    fall = np.sqrt(2 * 0.1 / 9.81)
    starts = fall * (1.0 + 2.0 * sum(0.5**k for k in range(1, bounce + 1)))
    top = starts + fall * 0.5 ** (bounce + 1)
    heights = exact_height(np.array([0.0, starts, top]))
    assert heights == pytest.approx([0.1, 0.0, 0.1 * 0.25 ** (bounce + 1)], abs=1e-12)


def test_restitution_is_read_from_the_record_of_the_collisions() -> None:
    """The engine's collisions meet e exactly; a planted fault, the impulse a tenth too large, does not."""
    from dataclasses import replace

    from verification.hard_cases.judge_trajectory import run_in_world
    from verification.hard_cases.restitution import restitution_residual

    case = HARD_CASES["chatter"]()
    assert isinstance(case, TrajectoryCase)
    run = run_in_world(case.scene, "IAPB")
    assert restitution_residual(run) < 1e-12
    found = run.impacts
    stronger = replace(found, v_plus=found.v_plus + 0.1 * (found.v_plus - found.v_minus))
    faulty = replace(run, impacts=stronger)
    assert restitution_residual(faulty) == pytest.approx(0.1 / 1.1)
    assert judge_hard_case(case, "IAPB", lambda scene, world: faulty).verdict == "restitution unmet"
    assert np.isnan(restitution_residual(run_in_world(case.scene, "PB")))
