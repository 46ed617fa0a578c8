"""With one restitution coefficient the Newton LCP is passive whatever the signs of the velocities."""

from verification.proofs.algebra import vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Square, Term
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_MOST_ONE,
    INVERSE_MASS,
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

BALL = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "p": [1], "v": [-1]}, e=0)


def statement() -> Statement:
    p, after = vector("p", "c"), vector("v⁺", "d")
    name = equation("momentum balance", after, v + MI * J.T * p)
    complementary = equation("p ⟂ J v⁺ + e J v", p.T * (J * after + e * J * v), 0)
    loss = identity(
        "twice the loss, times 1 + e",
        (1 + e) * (v.T * M * v - after.T * M * after),
        (1 - e) * p.T * W * p,
        (name, name.T, *MASS_RULES),
        "complementarity gives pᵀ W p = −(1+e) pᵀ J v",
        first=(Cofactor(-2 * ONE, complementary, ONE),),
    )
    passive = positivity(
        "and it is not negative", loss.claim.rhs, (Term(1, (E_AT_MOST_ONE,), Square(MI * J.T * p, DEFINITE_MASS)),),
        MASS_RULES,
    )  # fmt: skip
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "p": [1], "v": [-1, 0]}
    return Statement(
        name="newton_lcp_equal",
        title="With equal restitution the Newton LCP is passive for all velocities",
        source="docs/theory.md, sharpened",
        statement=(
            r"If $v^+ = v + M^{-1} J^\top p$ and $p^\top (J v^+ + e J v) = 0$ with one scalar $e \in (-1, "
            r"1]$, then twice the loss is $\frac{1-e}{1+e} \, p^\top W p \geq 0$: no sign of $p$ or of $J "
            r"v$ is used."
        ),
        given=(*MASS, complementary, E_AT_MOST_ONE),
        definitions=(name,),
        steps=(*MASS_LEMMAS, loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=BALL,
        needed=(
            Without(SYMMETRIC_MASS.name, BALL.with_values(skew)),
            Without(INVERSE_MASS.name, BALL.with_values(M=[[2]])),
            Without(DEFINITE_MASS.name, BALL.with_values({"M": [[-1]], "M⁻¹": [[-1]], "p": [-1]})),
            Without(complementary.name, BALL.with_values(p=[3])),
            Without(E_AT_MOST_ONE.name, BALL.with_values(e=2, p=[3])),
        ),
        twins=(
            Twin(
                "the loss is pᵀ W p for every e",
                equation("KE − KE⁺", v.T * M * v - after.T * M * after, p.T * W * p),
                BALL.with_values(e="1/2", p=["3/2"]),
            ),
        ),
    )
