"""(35): independent rows make the Delassus matrix positive definite, hence invertible."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cancelling, Cofactor, Square, Term
from verification.proofs.vocabulary import DEFINITE_MASS, INVERSE_MASS, MI, ONE, J, M, W

CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "K": [[1]], "x": [1], "y": [0]})
NULL = instance(
    {"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "K": [[1], [0]], "x": [1], "y": [1]}
)


def statement() -> Statement:
    right_inverse, x, y = matrix("K", "d", "c"), vector("x", "c"), vector("y", "c")
    independent = equation("the rows are independent: J K = I", J * right_inverse, 1)
    zero = equation("yᵀ J M⁻¹ Jᵀ y = 0", y.T * W * y, 0)
    half = equation("M⁻¹ Jᵀ y = 0", MI * J.T * y, 0)
    form = positivity(
        "J M⁻¹ Jᵀ is never negative",
        x.T * W * x,
        (Term(1, (), Square(MI * J.T * x, DEFINITE_MASS)),),
        (INVERSE_MASS,),
        "it is twice the kinetic energy of M⁻¹ Jᵀ x",
    )
    square = identity(
        "the energy of M⁻¹ Jᵀ y is 0", half.lhs.T * M * half.lhs, 0, (INVERSE_MASS, zero, zero.T)
    )
    end = identity(
        "y = 0",
        y,
        0,
        because="y = Kᵀ Jᵀ y = Kᵀ M (M⁻¹ Jᵀ y)",
        first=(
            Cofactor(right_inverse.T * M, half, ONE),
            Cofactor(-right_inverse.T, INVERSE_MASS, J.T * y),
            Cofactor(-ONE, independent.T, y),
        ),
    )
    return Statement(
        name="delassus_definite",
        title="Independent rows make the Delassus matrix definite",
        source="paper (35)",
        statement=(
            r"If the rows of $J$ are independent ($J K = I$ for some $K$) and $M \succ 0$, then $x^\top J "
            r"M^{-1} J^\top x \geq 0$ for every $x$, and $y^\top J M^{-1} J^\top y = 0$ only for $y = 0$."
        ),
        given=(INVERSE_MASS, DEFINITE_MASS, independent, zero),
        steps=(form, square, Cancelling(half, square.claim, DEFINITE_MASS), end),
        concludes=(form.claim.name, end.claim.name),
        witness=CASE,
        needed=(
            Without(INVERSE_MASS.name, CASE.with_values(**{"M⁻¹": [[0]], "y": [1]})),
            Without(DEFINITE_MASS.name, NULL, "forces along (1, 1) do no work on masses 1 and −1"),
            Without(independent.name, CASE.with_values(J=[[0]], y=[1]), "a row of zeros"),
            Without(zero.name, CASE.with_values(y=[1])),
        ),
        twins=(
            Twin(
                "the bound would hold without the factor λ_min(M⁻¹)",
                NonNegative("xᵀ W x ≥ xᵀ J Jᵀ x", x.T * W * x - x.T * J * J.T * x),
                CASE.with_values(**{"M": [[2]], "M⁻¹": [["1/2"]]}),
            ),
        ),
        remarks=("(35) as printed ends in v vᵀ, a matrix; read vᵀ v.",),
    )
