"""Letters, hypotheses and small lemmas that many statements share, so that each is written once.

c contacts, d degrees of freedom. M (d x d) mass matrix, J (c x d) contact Jacobian, G (c x c) any {1}-inverse of the
Delassus matrix W = J M⁻¹ Jᵀ, v (d) velocity before the impact, e restitution.
"""

from __future__ import annotations

from verification.proofs.algebra import expression, matrix, scalar, vector
from verification.proofs.facts import Definite, NonNegative, equation
from verification.proofs.rewriting import identity
from verification.proofs.steps import Cancelling, Cofactor, Identity, Step

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
    (
        Cofactor(-MI.T, INVERSE_MASS, ONE),
        Cofactor(-MI.T, SYMMETRIC_MASS, MI),
        Cofactor(ONE, INVERSE_MASS.T, MI),
    ),
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


TRANSPOSED_INVERSE = identity(
    "W Gᵀ W = W, with W = J M⁻¹ Jᵀ",
    W * G.T * W,
    W,
    (INVERSE_SYMMETRIC.claim,),
    "transpose W G W = W",
    first=(Cofactor(ONE, GENERALIZED_INVERSE.T, ONE),),
)


def _row_space_lemmas() -> tuple[Step, ...]:
    """W G J = J for every {1}-inverse G of W: what is true on the range of W is true on the range of J.

    With N = W G J − J: N M⁻¹ Nᵀ = 0 by W G W = W alone, and M is positive definite, so M⁻¹ Nᵀ = 0 and N = 0.
    """
    residual = W * G * J - J
    square = identity(
        "N M⁻¹ Nᵀ = 0 for N = W G J − J",
        (MI * residual.T).T * M * (MI * residual.T),
        0,
        (*MASS_RULES, GENERALIZED_INVERSE, TRANSPOSED_INVERSE.claim),
        "expand: every W G W and W Gᵀ W is W, and the four terms cancel",
    )
    half = equation("M⁻¹ Nᵀ = 0", MI * residual.T, 0)
    end = identity(
        "W G J = J", W * G * J, J, MASS_RULES, "N = (M⁻¹ Nᵀ)ᵀ M", first=(Cofactor(ONE, half.T, M),)
    )
    return TRANSPOSED_INVERSE, square, Cancelling(half, square.claim, DEFINITE_MASS), end


ROW_SPACE_LEMMAS = _row_space_lemmas()
ON_ROW_SPACE = equation("W G J = J", W * G * J, J)
