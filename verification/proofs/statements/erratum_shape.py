"""Erratum: J_i is said to be d x 3, but (1) multiplies a force by its transpose."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin
from verification.proofs.vocabulary import v


def statement() -> Statement:
    jacobian, force = matrix("Jᵢ", "k", "d"), vector("F", "k")
    work = identity(
        "power at the contact = power in the joints", force.T * (jacobian * v), (jacobian.T * force).T * v
    )
    square = matrix("Jᵢ", "d", "d")
    case = instance({"Jᵢ": [[0, 1, 0], [0, 0, 0], [0, 0, 0]], "F": [1, 0, 0], "v": [0, 1, 0]})
    return Statement(
        name="erratum_shape",
        title="Erratum: the manipulator Jacobian is 3 x d, not d x 3",
        source="paper, below (1); the same for J_h (6 x d)",
        statement=(
            r"$J_i^\top F_i$ in (1) has $d$ components, and $J_i \dot q$ is a velocity in space, only if "
            r"$J_i$ is $3 \times d$. Then the powers agree, $F_i^\top (J_i \dot q) = (J_i^\top F_i)^\top "
            r"\dot q$."
        ),
        steps=(work,),
        concludes=(work.claim.name,),
        twins=(
            Twin(
                "the printed shape, where it can be read at all (d = 3): the force map would be the "
                "transpose",
                equation(
                    "Fᵀ J v = (J F)ᵀ v", vector("F", "d").T * square * v, (square * vector("F", "d")).T * v
                ),
                case,
                "for d other than 3 the product does not even exist",
            ),
        ),
    )
