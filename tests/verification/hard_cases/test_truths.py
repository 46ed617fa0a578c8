"""The truths of the hard cases, against laws that are known by hand."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from verification.hard_cases import HARD_CASES, HardCase
from verification.hard_cases.exact_outcomes import exact_poisson


def _impact(name: str) -> HardCase:
    case = HARD_CASES[name]()
    assert isinstance(case, HardCase)
    return case


def _exact(numbers: Any) -> Any:
    """The array of fractions, to compute with numpy."""
    return np.vectorize(Fraction, otypes=[object])(numbers)


def _energy(case: HardCase, velocity: Any) -> Fraction:
    return _exact(velocity) @ _exact(case.mass_matrix) @ _exact(velocity) / 2


def test_poissons_law_on_the_bar() -> None:
    """Contact 1 alone stops and returns the bar: p_c = 1/(1 + 3) each way, by hand."""
    mass = _exact([[1, 0], [0, "1/12"]])
    rows = _exact([[1, "1/2"], [1, "2/5"]])
    velocity, pushing = exact_poisson(mass, rows, [-1, 0], [1, 0])
    assert velocity @ mass @ velocity / 2 <= Fraction(1, 2) and min(rows @ velocity) >= 0
    assert pushing >= 1 and _impact("bar_with_unequal_restitution").truth.rank == pushing


def test_the_break_shot_is_that_of_billiards() -> None:
    """Striker: 1 − 4 n²/(1 + 2 n²) of its speed, with n = 4/5 between the balls' line and the way;
    energy kept."""
    case = _impact("break_shot")
    after = case.truth.velocity
    n = Fraction(4, 5)
    assert after[0] == -(1 - 4 * n**2 / (1 + 2 * n**2)) and after[1] == 0
    assert after[2] == after[4] and after[3] == -after[5]
    assert _energy(case, after) == Fraction(1, 2)


def test_all_stop_or_return_as_by_hand() -> None:
    assert _impact("touching_cradle_impact").truth.velocity == (
        Fraction(-3, 5),
        *(Fraction(2, 5),) * 4,
    )
    assert (
        _impact("wedged_peg").truth.velocity == (0, 0, 0) and _impact("wedged_peg").truth.rank == 3
    )
    stack = _impact("stack_of_mass_ratio")
    wedge = _impact("wedge")
    masses = _exact(np.diag(stack.mass_matrix))
    assert set(stack.truth.velocity) == {masses @ _exact(stack.velocity) / sum(masses)}
    assert wedge.truth.velocity == tuple(Fraction(-1, 2) * Fraction(x) for x in wedge.velocity)


def test_the_rocking_block_keeps_housners_share() -> None:
    """ω⁺/ω⁻ = 1 − 3/2 sin² α, sin α = 3/5, so that ¾ (…)² of its energy is left after each rock."""
    case = _impact("rocking_block")
    after = case.truth.velocity
    share = 1 - Fraction(3, 2) * Fraction(9, 25)
    assert float(after[2] - share) == pytest.approx(0.0, abs=1e-15)  # the inertia 25/3 is a double
    left = _energy(case, after) / _energy(case, case.velocity)
    assert float(left) == pytest.approx(float(share) ** 2, abs=1e-14)


def test_the_superball_returns_its_point_of_contact() -> None:
    case = _impact("superball")
    before = _exact(case.velocity)
    after = case.truth.velocity
    assert not (_exact(case.contact_jacobian) @ (before + after)).any()
    assert _energy(case, before) == _energy(case, after)


@pytest.mark.parametrize(
    ("name", "point"),
    [
        ("sleeping_top", ("0", "0", "-1/2")),
        ("rolling_coin", ("3/5", "0", "-4/5")),
        ("rattleback", ("1/2", "0", "-1/4")),
    ],
)
def test_a_held_point_rests_and_keeps_the_angular_momentum_about_it(
    name: str, point: tuple[str, ...]
) -> None:
    case = _impact(name)
    r = _exact(point)
    after = _exact(case.truth.velocity)
    momentum = _exact(case.mass_matrix) @ (_exact(case.truth.velocity) - _exact(case.velocity))
    assert not (after[:3] + np.cross(after[3:], r)).any()
    assert not (
        momentum[3:] - np.cross(r, momentum[:3])
    ).any()  # about the point at r from the centre of mass


def test_the_top_sleeps_and_the_rattleback_spins_by_its_product_of_inertia() -> None:
    top = _impact("sleeping_top").truth.velocity
    assert top == (Fraction(1, 20), 0, 0, 0, Fraction(1, 10), 1000)
    celt = _impact("rattleback")
    spins = []
    for product in (-36.0, 36.0, 0.0):
        mass = celt.mass_matrix.copy()
        mass[3, 4] = mass[4, 3] = product
        spins.append(replace(celt, mass_matrix=mass).truth.velocity[5])
    assert spins[0] == Fraction(120, 3607) and spins[1] == -spins[0] and spins[2] == 0
