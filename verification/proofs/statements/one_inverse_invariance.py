"""The step that the paper's proof of (33) needs: every {1}-inverse gives the same Jᵀ G J."""

from verification.proofs.algebra import matrix
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.linear import impact_case
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    GENERALIZED_INVERSE,
    INVERSE_MASS,
    ON_ROW_SPACE,
    ONE,
    ROW_SPACE_LEMMAS,
    G,
    J,
    W,
    column_space_lemmas,
    on_column_space,
)


def statement() -> Statement:
    other = matrix("H", "c", "c")
    given = equation("H is a {1}-inverse of J M⁻¹ Jᵀ", W * other * W, W)
    same = identity(
        "the {1}-inverse does not matter",
        J.T * G * J,
        J.T * other * J,
        (ON_ROW_SPACE,),
        "Jᵀ G J = (Jᵀ H W) G J = Jᵀ H (W G J) = Jᵀ H J",
        first=(Cofactor(-ONE, on_column_space(other, "H"), G * J),),
    )
    case = impact_case([[1]], [[1], [1]], [0]).with_values(H=[[1, 0], [0, 0]])
    null = {"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "G": [[1]], "H": [[2]]}
    return Statement(
        name="one_inverse_invariance",
        title="Every {1}-inverse gives the same impact",
        source="the step missing from Appendix III of the paper",
        statement=(
            r"If $W G W = W$ and $W H W = W$ for $W = J M^{-1} J^\top$, then $J^\top G J = J^\top H J$: the "
            r"velocity after the impact does not depend on which generalized inverse is used."
        ),
        given=(INVERSE_MASS, DEFINITE_MASS, GENERALIZED_INVERSE, given),
        steps=(*ROW_SPACE_LEMMAS, *column_space_lemmas(other, "H", given), same),
        concludes=(same.claim.name,),
        witness=case,
        needed=(
            Without(INVERSE_MASS.name, instance({**null, "M": [[1, 0], [0, 1]]})),
            Without(DEFINITE_MASS.name, instance(null), "J M⁻¹ Jᵀ = 0: anything is a {1}-inverse"),
            Without(GENERALIZED_INVERSE.name, case.with_values(G=[[1, 0], [0, 1]])),
            Without(given.name, case.with_values(H=[[1, 0], [0, 1]])),
        ),
        twins=(
            Twin("the impulses agree as well", equation("G J = H J", G * J, other * J), case, "they do not"),
        ),
        remarks=(r"$M$ need not be symmetric here.",),
    )
