"""Comparisons of rational numbers that statements contain, and false ones (twins), computed in
exact fractions."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction

from flint import fmpq_mat

from verification.proofs import by_sympy, layout
from verification.proofs.cases import (
    Case,
    Comparison,
    all_hold,
    completed,
    holds,
    matrix_of,
    pseudo_inverse,
)
from verification.proofs.statement import Statement

Comparisons = tuple[Comparison, ...]
Twins = tuple[tuple[str, Comparison, str], ...]  # title, false comparison, note
# exact_instances
CASES = 40
SEED = 20050301
LARGEST = 4
SIZE = 2.0**-28  # distance of the second row from the direction of the first in fp_gram_pinv


def _is(says: str, left: Fraction | int, relation: str, right: Fraction | int | str) -> Comparison:
    return Comparison(says, Fraction(left), relation, Fraction(right))


def unequal_restitution() -> tuple[Comparisons, Twins]:
    """The bar's energies from its velocities: before the impact (−1, 0), after it with J v⁺ = (1,
    0)."""
    spin = 1 / (Fraction(1, 2) - Fraction(2, 5))
    after = (-Fraction(2, 5) * spin) ** 2 / 2 + spin**2 / 24
    return (
        _is("the bar's energy after the impact, with v⁺ = (−4, 10)", after, "=", "73/6"),
        _is("the bar's energy is larger than before the impact", after, ">", "1/2"),
    ), ()


def erratum_rank() -> tuple[Comparisons, Twins]:
    all_rows, left_over = (fmpq_mat([[1]] * count).rank() for count in (3, 2))
    return (
        _is("the rank of all three rows, so n = 1", all_rows, "=", 1),
        _is("the rank of the two rows left over", left_over, "=", 1),
    ), (("as printed", _is("rank(J_r) = r", left_over, "=", 2), ""),)


def erratum_spreading() -> tuple[Comparisons, Twins]:
    """A spread impulse, step by step; each step applies Newton's law anew: 2 kg, −0.1 m/s, e = 1/2,
    15 N, 512 Hz."""
    mass = Fraction(2)
    speed = Fraction(-1, 10)
    e = Fraction(1, 2)
    most = Fraction(15, 512)
    steps = 0
    while speed < 0:
        impulse = min(wanted := -(1 + e) * mass * speed, most)
        speed = speed + impulse / mass
        steps = steps + 1
        if impulse == wanted:
            break
    return (
        _is("steps taken: m = 2 kg, v = −0.1 m/s, e = 1/2, 15 N, 512 Hz", steps, "=", 7),
        _is("velocity reached [m/s], instead of 0.05", speed, "<", "26/10000"),
    ), (
        (
            "in numbers: the prescribed velocity",
            _is("velocity reached [m/s]", speed, "=", "1/20"),
            "",
        ),
    )


def erratum_saturation() -> tuple[Comparisons, Twins]:
    """The peg's energies for the full impulse and for the one clipped by the device: 15 N and 1 N m
    for 1/512 s."""
    mass = Fraction(2)
    inertia = Fraction(1, 200)
    arm = Fraction(1, 100)
    speed = Fraction(-1, 10)
    spin = Fraction(4)
    p = -(speed + arm * spin) / (1 / mass + arm**2 / inertia)
    force = min(p, Fraction(15, 512))
    torque = min(arm * p, Fraction(1, 512))

    def gained(force: Fraction, torque: Fraction) -> Fraction:
        return force * speed + force**2 / (2 * mass) + torque * spin + torque**2 / (2 * inertia)

    return (
        _is("energy gained with the full impulse [J]", gained(p, arm * p), "<", 0),
        _is("the impulse exceeds the force limit [N s]", p, ">", "15/512"),
        _is("its moment is below the torque limit [N m s]", arm * p, "<", "1/512"),
        _is("energy gained with the clipped impulse [J]", gained(force, torque), ">", 0),
    ), (
        (
            "saturation is passive: the peg struck at its corner",
            _is("energy gained with the clipped impulse [J]", gained(force, torque), "≤", 0),
            "",
        ),
    )


def spring_energy_after(*, implicit: bool) -> Fraction:
    """Return KE⁺ + Φ⁺ of one mass on its spring, with the force of the step's end (implicit) or of
    its start.

    M = 1 kg at rest, K = 8 N/m, B = 0, φ = −1 m, h = 1 s.
    """
    speed = Fraction(8, 1 + 8 * implicit)
    return speed**2 / 2 + 4 * min(speed - 1, Fraction(0)) ** 2


def resting_contact() -> tuple[Comparisons, Twins]:
    return (
        _is("KE⁺ + Φ⁺ of one mass, implicit force [J]", spring_energy_after(implicit=True), "≤", 4),
    ), (
        (
            "the same with the explicit force, max(0, −K φ − B γ*)",
            _is(
                "KE⁺ + Φ⁺ of one mass, explicit force [J]",
                spring_energy_after(implicit=False),
                "≤",
                4,
            ),
            "M = 1 kg at rest, K = 8 N/m, B = 0, φ = −1 m, h = 1 s: 32 J after the step, 4 J before",
        ),
    )


def resting_energy() -> tuple[Comparisons, Twins]:
    return (), resting_contact()[1]


def energy_factor(k: int) -> Fraction:
    """Return KE⁺/KE⁻ of an elastic impact with a rounded Delassus matrix W; all other quantities
    are exact.

    M = I, J = [1 0; a t] with a = 1 − 2⁻ᵏ, t = 2⁻²⁸, v = (0, 1). The entries of W are computed in
    doubles; its inverse, the impulse and v⁺ are rational.
    """
    a = 1.0 - 2.0**-k
    return _energy_after(Fraction(a), Fraction(SIZE), Fraction(a * a + SIZE * SIZE))


def energy_factor_above_cutoff(ulps: int) -> Fraction:
    """Return KE⁺/KE⁻ as in `energy_factor` for a = 1 and t² = (ulps + 0.49) ε.

    The computed W keeps its rank above a cutoff of ulps ε/4.
    """
    t = ((ulps + 0.49) * 2.0**-52) ** 0.5
    return _energy_after(Fraction(1), Fraction(t), Fraction(1.0 + t * t))


def _energy_after(a: Fraction, t: Fraction, last: Fraction) -> Fraction:
    """Return KE⁺/KE⁻ for W = [1 a; a last], by p = −2 W⁻¹ (0, t)."""
    p = 2 * t * a / (last - a * a), -2 * t / (last - a * a)
    return (p[0] + a * p[1]) ** 2 + (1 + t * p[1]) ** 2


def fp_gram_pinv() -> tuple[Comparisons, Twins]:
    cut = energy_factor_above_cutoff(19)
    return (
        *(
            _is(
                f"energy after / before, k = {k}",
                energy_factor(k),
                "=",
                (1 + Fraction(2) ** (2 * k - 55)) ** 2,
            )
            for k in (28, 32, 40, 52)
        ),
        _is("k = 28: nine times the energy", energy_factor(28), "=", 9),
        _is("energy after / before, with a cutoff of 1e-15", cut, ">", "11/10"),
        _is(
            "energy after / before, with a cutoff of 1e-12",
            energy_factor_above_cutoff(18100),
            ">",
            "10001/10000",
        ),
    ), (
        (
            "the energy grows at most by the factor 10⁶",
            _is("k = 52", energy_factor(52), "≤", 10**6),
            "",
        ),
        ("a cutoff of 1e-15 makes it passive", _is("energy after / before", cut, "≤", 1), ""),
    )


def random_case(draw: random.Random) -> Case:
    """Return a rational impact: M = B Bᵀ + I, rows of J with repeats and combinations, e = p/q in
    [−1, 1]."""
    d = draw.randint(1, LARGEST)
    c = draw.randint(1, LARGEST + 1)

    def matrix(rows: int, columns: int) -> list[list[Fraction]]:
        return [
            [Fraction(draw.randint(-5, 5), draw.randint(1, 4)) for _ in range(columns)]
            for _ in range(rows)
        ]

    root = matrix_of(matrix(d, d))
    rows = matrix(c, d)
    if c > 1:
        rows[-1] = [2 * entry for entry in rows[0]]
    mass = root * root.transpose() + fmpq_mat([[int(i == j) for j in range(d)] for i in range(d)])
    inverse = mass.inv()
    jacobian = matrix_of(rows)
    return {
        "M": mass,
        "M⁻¹": inverse,
        "J": jacobian,
        "v": matrix_of(matrix(d, 1)),
        "G": pseudo_inverse(jacobian * inverse * jacobian.transpose()),
        "e": matrix_of([[Fraction(draw.randint(-6, 6), 6)]]),
    }


def exact_instances() -> tuple[Comparisons, Twins]:
    """Theorem 2 on random rational impacts: the kernel with python-flint, and SymPy, each reads
    theorem_2 by itself."""
    draw = random.Random(SEED)
    block = layout.block("theorem_2")
    theorem = Statement(block)
    cases = [completed(random_case(draw), theorem.definitions) for _ in range(CASES)]
    shown = [entry.formula for entry in block.all("show")]
    printed = theorem.reader.fact(block.all("twin")[0].formula)
    redundant = sum(case["J"].rank() < case["J"].nrows() for case in cases)
    by_flint = sum(all_hold(theorem.conclusions, case) for case in cases)
    both = sum(
        all(by_sympy.holds(block, formula, case) for formula in shown)
        for case in cases[: CASES // 4]
    )
    wrong = sum(holds(printed, case) for case in cases)
    return (
        _is("cases with redundant rows", redundant, ">", CASES // 2),
        _is(
            "cases that satisfy the hypotheses",
            sum(all_hold(theorem.given, case) for case in cases),
            "=",
            CASES,
        ),
        _is("cases where all conclusions hold, python-flint", by_flint, "=", CASES),
        _is("cases where all conclusions hold, SymPy", both, "=", CASES // 4),
        _is(
            "cases where the loss as printed in (24) holds (only those that lose nothing)",
            wrong,
            "<",
            CASES // 2,
        ),
    ), (("the printed loss holds in all cases", _is("cases", wrong, "=", CASES), ""),)


BY_STATEMENT: dict[str, Callable[[], tuple[Comparisons, Twins]]] = {
    each.__name__: each
    for each in (
        unequal_restitution,
        erratum_rank,
        erratum_spreading,
        erratum_saturation,
        resting_contact,
        resting_energy,
        fp_gram_pinv,
        exact_instances,
    )
}
