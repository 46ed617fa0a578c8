"""(19) = (27): momentum balance and Newton's law leave one impulse, when the rows are independent."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import MI, ONE, J, M, W, e, v

CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "W⁻¹": [[1]], "v": [-1], "v⁺": [0], "p": [1]}, e=0)


def statement() -> Statement:
    delassus_inverse, after, p = matrix("W⁻¹", "c", "c"), vector("v⁺", "d"), vector("p", "c")
    mass_inverse = equation("M⁻¹ M = I", MI * M, 1)
    inverse = equation("W⁻¹ is a left inverse of J M⁻¹ Jᵀ", delassus_inverse * W, 1)
    balance = equation("momentum balance (9)", M * after, M * v + J.T * p)
    law = equation("Newton's law (15)", J * after, -e * J * v)
    impulse = identity(
        "the impulse (19)",
        p,
        -(1 + e) * delassus_inverse * J * v,
        (mass_inverse, law),
        "p = W⁻¹ J M⁻¹ (Jᵀ p) = W⁻¹ J (v⁺ − v) = −(1+e) W⁻¹ J v",
        first=(Cofactor(-ONE, inverse, p), Cofactor(-delassus_inverse * J * MI, balance, ONE)),
    )
    return Statement(
        name="impulse_of_independent_rows",
        title="The impulse (19) is the only one",
        source="paper (19), (27)",
        statement=(
            r"If $M v^+ = M v + J^\top p$ and $J v^+ = -e J v$, and $W = J M^{-1} J^\top$ is invertible, "
            r"then $p = -(1+e) W^{-1} J v$."
        ),
        given=(mass_inverse, inverse, balance, law),
        steps=(impulse,),
        concludes=(impulse.claim.name,),
        witness=CASE,
        needed=(
            Without(mass_inverse.name, CASE.with_values(**{"M⁻¹": [[2]], "W⁻¹": [["1/2"]]})),
            Without(
                inverse.name,
                instance(
                    {"M": [[1]], "M⁻¹": [[1]], "J": [[1], [1]], "W⁻¹": [["1/4", "1/4"], ["1/4", "1/4"]]},
                    v=[-1],
                    p=[1, 0],
                    e=0,
                ).with_values(**{"v⁺": [0]}),
                "one wall reported twice: any split of the impulse does, (19) names one of them",
            ),
            Without(balance.name, CASE.with_values(p=[7])),
            Without(law.name, CASE.with_values(**{"v⁺": [1], "p": [2]})),
        ),
        twins=(
            Twin(
                "an impulse without the 1 + e",
                equation("p = −e W⁻¹ J v", p, -e * delassus_inverse * J * v),
                CASE,
                "a plastic collision would need no impulse",
            ),
        ),
    )
