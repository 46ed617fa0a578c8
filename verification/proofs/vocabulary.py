"""Letters, hypotheses and small lemmas that many statements share.

There are c contacts and d degrees of freedom. M (d x d) is the mass matrix, J (c x d) the contact Jacobian, G (c x c)
any {1}-inverse of the Delassus matrix W = J M⁻¹ Jᵀ, v (d) the velocity before the impact, and e the restitution.
"""

from __future__ import annotations

from verification.proofs.algebra import (
    Definite,
    Equation,
    Expression,
    NonNegative,
    equation,
    expression,
    matrix,
    scalar,
    vector,
)
from verification.proofs.steps import Cancelling, Cofactor, Identity, Step, identity

ONE = expression(1)
M = matrix("M", "d", "d")
MI = matrix("M⁻¹", "d", "d")
J = matrix("J", "c", "d")
G = matrix("G", "c", "c")
v = vector("v", "d")
e = scalar("e")
W = J * MI * J.T

SYMMETRIC_MASS = equation("M is symmetric", M.T, M)
INVERSE_MASS = equation("M M⁻¹ = I", M * MI, 1)
DEFINITE_MASS = Definite("M is positive definite", M)
MASS = (SYMMETRIC_MASS, INVERSE_MASS, DEFINITE_MASS)
E_AT_MOST_ONE = NonNegative("e ≤ 1", 1 - e)
E_AT_LEAST_MINUS_ONE = NonNegative("e ≥ −1", 1 + e)
GENERALIZED_INVERSE = equation("G is a {1}-inverse of J M⁻¹ Jᵀ", W * G * W, W)

INVERSE_SYMMETRIC = Identity(
    equation("M⁻¹ is symmetric", MI.T, MI),
    (Cofactor(-MI.T, INVERSE_MASS, ONE), Cofactor(-MI.T, SYMMETRIC_MASS, MI), Cofactor(ONE, INVERSE_MASS.T, MI)),
    "M⁻ᵀ = M⁻ᵀ (M M⁻¹) = (M⁻ᵀ Mᵀ) M⁻¹ = M⁻¹",
)
INVERSE_FROM_LEFT = Identity(
    equation("M⁻¹ M = I", MI * M, 1),
    (
        Cofactor(ONE, INVERSE_MASS.T, ONE),
        Cofactor(-ONE, INVERSE_SYMMETRIC.claim, M),
        Cofactor(-MI.T, SYMMETRIC_MASS, ONE),
    ),
    "the transpose of M M⁻¹ = I",
)
MASS_LEMMAS = (INVERSE_SYMMETRIC, INVERSE_FROM_LEFT)
MASS_RULES = (SYMMETRIC_MASS, INVERSE_SYMMETRIC.claim, INVERSE_MASS, INVERSE_FROM_LEFT.claim)


def row_space_lemmas(inverse: Expression, name: str, given: Equation) -> tuple[Step, ...]:
    """Return steps that prove W G J = J for a {1}-inverse G of W (`given`: W G W = W).

    Let N = W G J − J. W G W = W alone gives N M⁻ᵀ Nᵀ = 0. M is positive definite, so M⁻¹ Nᵀ = 0 and N = 0. The last
    step is the lemma; the others prepare it. The proof uses no symmetry.
    """
    return _vanishing_residual(W * inverse * J - J, f"W {name} J − J", on_row_space(inverse, name), given)


def column_space_lemmas(inverse: Expression, name: str, given: Equation) -> tuple[Step, ...]:
    """Return steps that prove Jᵀ G W = Jᵀ for a {1}-inverse G of W (`given`: W G W = W)."""
    return _vanishing_residual(
        (J.T * inverse * W - J.T).T, f"(Jᵀ {name} W − Jᵀ)ᵀ", on_column_space(inverse, name), given
    )


def _vanishing_residual(residual: Expression, words: str, lemma: Equation, given: Equation) -> tuple[Step, ...]:
    half = equation(f"M⁻¹ Nᵀ = 0 for N = {words}", MI * residual.T, 0)
    square = identity(
        f"(M⁻¹ Nᵀ)ᵀ M (M⁻¹ Nᵀ) = 0 for N = {words}",
        half.lhs.T * M * half.lhs,
        0,
        (INVERSE_MASS, given, given.T),
        "M M⁻¹ = I leaves N M⁻ᵀ Nᵀ; with the {1}-inverse its four terms cancel",
    )
    zero = half.T if lemma.lhs.rows == "c" else half
    outer = (ONE, M.T) if lemma.lhs.rows == "c" else (M, ONE)
    rules = (INVERSE_MASS, INVERSE_MASS.T)
    end = identity(lemma.name, lemma.lhs, lemma.rhs, rules, "Nᵀ = M (M⁻¹ Nᵀ)", (Cofactor(outer[0], zero, outer[1]),))
    return square, Cancelling(half, square.claim, DEFINITE_MASS), end


def on_row_space(inverse: Expression, name: str) -> Equation:
    """Return the conclusion of `row_space_lemmas`."""
    return equation(f"W {name} J = J", W * inverse * J, J)


def on_column_space(inverse: Expression, name: str) -> Equation:
    """Return the conclusion of `column_space_lemmas`."""
    return equation(f"Jᵀ {name} W = Jᵀ", J.T * inverse * W, J.T)


ROW_SPACE_LEMMAS = row_space_lemmas(G, "G", GENERALIZED_INVERSE)
ON_ROW_SPACE = on_row_space(G, "G")
