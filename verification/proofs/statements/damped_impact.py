"""Damping: (W + λ I)⁻¹ in the place of the pseudo-inverse is passive, at the price of Newton's law."""

from verification.proofs.algebra import matrix, scalar, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Square, Term
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_LEAST_MINUS_ONE,
    E_AT_MOST_ONE,
    INVERSE_MASS,
    INVERSE_SYMMETRIC,
    MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ONE,
    SYMMETRIC_MASS,
    J,
    M,
    W,
    e,
    v,
)

CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "X": [["1/2"]], "v": [-1]}, λ=1, e=0)


def statement() -> Statement:
    x, lam, after = matrix("X", "c", "c"), scalar("λ"), vector("v⁺", "d")
    inverse = equation("X = (J M⁻¹ Jᵀ + λ I)⁻¹", (W + lam) * x, 1)
    positive = NonNegative("λ ≥ 0", lam)
    name = equation("the damped impact", after, v - (1 + e) * MI * J.T * x * J * v)
    symmetric = identity(
        "X is symmetric",
        x.T,
        x,
        (INVERSE_SYMMETRIC.claim,),
        "X = (W + λ) Xᵀ X transposed, as for every inverse of a symmetric matrix",
        first=(Cofactor(-x.T, inverse, ONE), Cofactor(ONE, inverse.T, x)),
    )
    y = x * J * v
    split = identity(
        "X = X W X + λ X²",
        x.T,
        x * W * x + lam * x * x,
        (symmetric.claim,),
        first=(Cofactor(-x, inverse, ONE),),
    )
    loss = v.T * M * v - after.T * M * after
    rules = (name, name.T, *MASS_RULES)
    form = identity(
        "twice the loss of kinetic energy",
        loss,
        (1 + e) * (1 - e) * y.T * W * y + 2 * (1 + e) * lam * y.T * y,
        (*rules, symmetric.claim),
        "2 X − (1+e) X W X = (1−e) X W X + 2 λ X²",
        first=(Cofactor(2 * (1 + e) * v.T * J.T, split.claim, J * v),),
    )
    passive = positivity(
        "the kinetic energy does not grow",
        form.claim.rhs,
        (
            Term(1, (E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE), Square(MI * J.T * y, DEFINITE_MASS)),
            Term(2, (E_AT_LEAST_MINUS_ONE, positive), Square(y)),
        ),
        (*MASS_RULES, symmetric.claim),
    )
    return Statement(
        name="damped_impact",
        title="The damped impact is passive",
        source="docs/theory.md (damping); a spectral filter with its own certificate",
        statement=(
            r"With $X = (W + \lambda I)^{-1}$, $\lambda \geq 0$, and $v^+ = v - (1+e) M^{-1} J^\top X J v$ "
            r"twice the loss is $(1-e^2) \, y^\top W y + 2 (1+e) \lambda \, y^\top y \geq 0$ with $y = X J "
            r"v$, for every $e \in [-1, 1]$."
        ),
        given=(*MASS, inverse, positive, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=(name,),
        steps=(*MASS_LEMMAS, symmetric, split, form, passive),
        concludes=(form.claim.name, passive.claim.name),
        witness=CASE,
        needed=(
            Without(SYMMETRIC_MASS.name, _skew()),
            Without(INVERSE_MASS.name, CASE.with_values(M=[[2]])),
            Without(DEFINITE_MASS.name, CASE.with_values({"M": [[-1]], "M⁻¹": [[-1]], "X": [[-1]]}, λ=0)),
            Without(inverse.name, CASE.with_values(X=[[3]])),
            Without(positive.name, CASE.with_values({"X": [[4]], "λ": "-3/4"})),
            Without(E_AT_MOST_ONE.name, CASE.with_values(e=4)),
            Without(E_AT_LEAST_MINUS_ONE.name, CASE.with_values(e=-2)),
        ),
        twins=(
            Twin(
                "Newton's law is still met",
                equation("J v⁺ = −e J v", J * after, -e * J * v),
                CASE,
                "with λ = W half of the approach velocity is left after a plastic impact",
            ),
        ),
    )


def _skew():  # type: ignore[no-untyped-def]
    return instance(
        {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "X": [[1]], "v": [1, 0]}, λ=0, e=0
    )
