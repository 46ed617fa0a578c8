"""Exact instances: random rational M and J, some with redundant rows, computed by python-flint and by sympy."""

import random
from fractions import Fraction

from verification.proofs import load
from verification.proofs.exact import (
    FlintBackend,
    Instance,
    Matrix,
    SympyBackend,
    completed,
    delassus,
    holds,
    impact_case,
    inverse,
)
from verification.proofs.statement import Statement, Twin
from verification.proofs.steps import Exact

CASES, SEED, LARGEST = 40, 20050301, 4


def random_case(draw: random.Random) -> Instance:
    """Return a rational impact: M = B Bᵀ + I, rows of J with repeats and combinations, e = p/q in [−1, 1]."""
    d, c = draw.randint(1, LARGEST), draw.randint(1, LARGEST + 1)

    def number() -> Fraction:
        return Fraction(draw.randint(-5, 5), draw.randint(1, 4))

    root = [[number() for _ in range(d)] for _ in range(d)]
    mass = [[sum((a * b for a, b in zip(x, y, strict=True)), Fraction(i == j)) for j, y in enumerate(root)]
            for i, x in enumerate(root)]  # fmt: skip
    rows = [[number() for _ in range(d)] for _ in range(c)]
    if c > 1:
        rows[-1] = [2 * entry for entry in rows[0]]
    return impact_case(mass, rows, [number() for _ in range(d)], e=Fraction(draw.randint(-6, 6), 6))


def exact_instances() -> Statement:
    """Theorem 2 on random rational impacts, with two exact libraries."""
    draw = random.Random(SEED)
    theorem = load("theorem_2")
    cases = [completed(random_case(draw), theorem.definitions) for _ in range(CASES)]
    redundant = sum(_is_redundant(case) for case in cases)
    total = Fraction(CASES)
    agree = {
        backend.name: sum(all(holds(fact, case, backend) for fact in theorem.conclusions) for case in cases[:count])
        for backend, count in ((FlintBackend, CASES), (SympyBackend, CASES // 4))
    }
    hypotheses = sum(all(holds(fact, case) for fact in theorem.given) for case in cases)
    wrong = sum(_printed_loss_holds(case) for case in cases)
    return Statement(
        title="Both sides as rational numbers",
        source="random rational instances",
        statement=(
            rf"{CASES} random rational impacts ($d \leq {LARGEST}$, redundant rows included, "
            r"$G$ the exact Moore-Penrose inverse): hypotheses and conclusions of Theorem 2 hold as equalities of "
            r"rational numbers, on two exact libraries."
        ),
        steps=(
            Exact("cases with redundant rows", Fraction(redundant), ">", Fraction(CASES // 2)),
            Exact("cases that satisfy the hypotheses", Fraction(hypotheses), "=", total),
            Exact(
                "cases where all conclusions hold, python-flint", Fraction(agree["python-flint"]), "=", Fraction(CASES)
            ),
            Exact("cases where all conclusions hold, sympy", Fraction(agree["sympy"]), "=", Fraction(CASES // 4)),
            Exact(
                "cases where the loss as printed in (24) holds (only those that lose nothing)",
                Fraction(wrong),
                "<",
                Fraction(CASES // 2),
            ),
        ),  # fmt: skip
        twins=(Twin("the printed loss holds in all cases", Exact("cases", Fraction(wrong), "=", Fraction(CASES))),),
    )


def _is_redundant(case: Instance) -> bool:
    """Whether W has no inverse."""
    w: Matrix = delassus(case.values["M"], case.values["J"])  # type: ignore[arg-type]
    try:
        inverse(w)
    except ZeroDivisionError:
        return True
    return False


def _printed_loss_holds(case: Instance) -> bool:
    return holds(load("theorem_2").twins[0].claim, case)  # type: ignore[arg-type]
