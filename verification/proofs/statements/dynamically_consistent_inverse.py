"""(28)-(31): the dynamically consistent inverse and the identity that Appendix I rests on."""

from verification.proofs.algebra import matrix
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import (
    INVERSE_MASS,
    INVERSE_SYMMETRIC,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ONE,
    SYMMETRIC_MASS,
    J,
    M,
    W,
)


def statement() -> Statement:
    wi, bar = matrix("W⁻¹", "c", "c"), matrix("J̄", "d", "c")
    inverse = equation("W W⁻¹ = I for W = J M⁻¹ Jᵀ", W * wi, 1)
    definition = equation("dynamically consistent inverse", bar, MI * J.T * wi)
    symmetric = identity(
        "W⁻¹ is symmetric",
        wi.T,
        wi,
        (INVERSE_SYMMETRIC.claim,),
        "W⁻ᵀ = W⁻ᵀ (W W⁻¹) = (W W⁻¹)ᵀ W⁻¹, because W is symmetric",
        first=(Cofactor(-wi.T, inverse, ONE), Cofactor(ONE, inverse.T, wi)),
    )
    rules = (definition, definition.T, *MASS_RULES, symmetric.claim, inverse)
    right = identity("J̄ is a right inverse of J", J * bar, 1, rules)
    twenty_nine = identity("(29)", M * bar * J, J.T * bar.T * M, rules, "both sides are Jᵀ W⁻¹ J")
    thirty = identity("(30)", J.T * bar.T * M * bar * J, M * bar * J, rules, "W⁻¹ W W⁻¹ = W⁻¹")
    euclid = matrix("J⁺", "d", "c")
    half = ["1/2"]
    case = instance(
        {
            "M": [[1, 0], [0, 2]],
            "M⁻¹": [[1, 0], [0, "1/2"]],
            "J": [[1, 1]],
            "W⁻¹": [["2/3"]],
            "J⁺": [half, half],
        }
    )
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 0]], "W⁻¹": [[1]]}
    return Statement(
        name="dynamically_consistent_inverse",
        title="The dynamically consistent inverse",
        source="paper (28)-(31), Appendix I",
        statement=(
            r"With $\bar J = M^{-1} J^\top W^{-1}$ and $W = J M^{-1} J^\top$ invertible: $J \bar J = I$, $M "
            r"\bar J J = J^\top \bar J^\top M$ and $J^\top \bar J^\top M \bar J J = M \bar J J$; so $\bar J "
            r"J$ is the projector, orthogonal in the kinetic metric, that the impact (28) applies."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS, inverse),
        definitions=(definition,),
        steps=(*MASS_LEMMAS, symmetric, right, twenty_nine, thirty),
        concludes=(right.claim.name, "(29)", "(30)"),
        witness=case,
        needed=(
            Without(
                SYMMETRIC_MASS.name, instance(skew), "(29) fails for a mass matrix that is not symmetric"
            ),
            Without(INVERSE_MASS.name, case.with_values(M=[[3, 0], [0, 1]])),
            Without(inverse.name, case.with_values(**{"W⁻¹": [[1]]})),
        ),
        twins=(
            Twin(
                "the plain pseudo-inverse of J would do as well",
                equation("(29) with J⁺ = Jᵀ (J Jᵀ)⁻¹", M * euclid * J, J.T * euclid.T * M),
                case,
                "J⁺ does not know the masses",
            ),
        ),
    )
