"""Comparisons of rational numbers that belong to a statement, and false ones (twins): those in its
text, and those that only a program computes, such as ranks and rounded entries."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import sympy
from flint import fmpq_mat

from verification.impacts import Family, integer_impacts
from verification.proofs import by_sympy, layout
from verification.proofs.cases import (
    Case,
    Comparison,
    all_hold,
    completed,
    holds,
    matrix_of,
    read_comparison,
)
from verification.proofs.statement import Statement

Comparisons = tuple[Comparison, ...]
Twins = tuple[tuple[str, Comparison, str], ...]  # title, false comparison, note
Compared = tuple[Comparisons, Twins]
# exact_instances
CASES = 40
SEED = 20050301
LARGEST = 4
SIZE = 2.0**-28  # distance of the second row from the direction of the first in fp_gram_pinv


def _is(says: str, left: Fraction | int, relation: str, right: Fraction | int | str) -> Comparison:
    return Comparison(says, Fraction(left), relation, Fraction(right))


def erratum_rank() -> Compared:
    all_rows, left_over = (fmpq_mat([[1]] * count).rank() for count in (3, 2))
    return (
        _is("the rank of all three rows, so n = 1", all_rows, "=", 1),
        _is("the rank of the two rows left over", left_over, "=", 1),
    ), (("as printed", _is("rank(J_r) = r", left_over, "=", 2), ""),)


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


def fp_gram_pinv() -> Compared:
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


def random_case(number: int) -> Case:
    """Return an impact of whole numbers, with d = 1 to 4; up to two rows depend on others, and e is
    a fraction in [−1, 1]."""
    rank = 1 + number % LARGEST
    family = Family(min(rank + number % 2, LARGEST), rank + number % 3, rank, 1.0)
    (impact,) = integer_impacts(family, 1, SEED + number)
    mass = matrix_of(impact.mass_matrix.tolist())
    jacobian = matrix_of(impact.contact_jacobian.tolist())
    inverse = mass.inv()
    return {
        "M": mass,
        "M⁻¹": inverse,
        "J": jacobian,
        "v": matrix_of(impact.velocity[:, None].tolist()),
        "G": pseudo_inverse(jacobian * inverse * jacobian.transpose()),
        "e": matrix_of([[Fraction(number % 13 - 6, 6)]]),
    }


def pseudo_inverse(matrix: fmpq_mat) -> fmpq_mat:
    """Return the Moore-Penrose inverse, which SymPy finds; the hypotheses of the theorem check it."""
    found = sympy.Matrix([[str(entry) for entry in row] for row in matrix.tolist()]).pinv()
    return matrix_of([[str(entry) for entry in row] for row in found.tolist()])


def exact_instances() -> Compared:
    """Theorem 2 on random rational impacts: the kernel with python-flint, and SymPy, each reads
    theorem_2 by itself."""
    block = layout.block("theorem_2")
    theorem = Statement(block)
    cases = [completed(random_case(number), theorem.definitions) for number in range(CASES)]
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


BY_STATEMENT: dict[str, Callable[[], Compared]] = {
    each.__name__: each for each in (erratum_rank, fp_gram_pinv, exact_instances)
}


def comparisons_of(block: layout.Block) -> Compared:
    """Return the comparisons of a statement and the false ones: those that a program computes, and
    those in its text."""
    compute = BY_STATEMENT.get(block.name)
    shown, false = compute() if compute else ((), ())
    for entry in block.all("numbers"):
        if entry.formula or not compute:
            shown = (*shown, read_comparison(entry.words, entry.formula))
    for entry in block.all("false"):
        title, _, words = entry.words.partition(" :: ")
        false = (*false, (title, read_comparison(words, entry.formula), entry.note))
    return shown, false
