"""Newton's law as a complementarity problem is passive when every contact given approaches."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import Entrywise, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Pairing, Term
from verification.proofs.vocabulary import (
    INVERSE_MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ONE,
    SYMMETRIC_MASS,
    J,
    M,
    v,
)

BALL = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "E": [[0]], "p": [1], "v": [-1]})


def statement() -> Statement:
    restitution, p, after = matrix("E", "c", "c"), vector("p", "c"), vector("v⁺", "d")
    name = equation("momentum balance", after, v + MI * J.T * p)
    pushes, approaching = Entrywise("p pushes", p), Entrywise("every contact approaches: −J v ≥ 0", -J * v)
    inelastic = Entrywise("I − E ≥ 0", 1 - restitution)
    complementary = equation("p ⟂ J v⁺ + E J v", p.T * (J * after + restitution * J * v), 0)
    steps_ = identity(
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        p.T * (1 - restitution) * (-J * v),
        (name, name.T, *MASS_RULES),
        "the loss is −pᵀ(J v + J v⁺), and pᵀ J v⁺ = −pᵀ E J v",
        first=(Cofactor(-ONE, complementary, ONE),),
    )
    passive = positivity(
        "the kinetic energy does not grow",
        steps_.claim.rhs,
        (Term(1, (), Pairing(pushes, approaching, inelastic)),),
    )
    return Statement(
        name="newton_lcp",
        title="The Newton LCP is passive when all its contacts approach",
        source="docs/theory.md (unequal restitution); Moreau",
        statement=(
            r"Let $v^+ = v + M^{-1} J^\top p$ with $p \geq 0$, $p^\top (J v^+ + E J v) = 0$, $J v \leq 0$ "
            r"and $E$ diagonal with $e_i \leq 1$. Then twice the loss is $p^\top (I - E)(-J v) \geq 0$."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS, pushes, approaching, inelastic, complementary),
        definitions=(name,),
        steps=(*MASS_LEMMAS, steps_, passive),
        concludes=(steps_.claim.name, passive.claim.name),
        witness=BALL,
        needed=(
            Without(SYMMETRIC_MASS.name, _skew()),
            Without(INVERSE_MASS.name, BALL.with_values(M=[[2]])),
            Without(pushes.name, _pulling(), "an adhesive contact"),
            Without(
                approaching.name, _mixed(), "contact 2 separates already: with e = (1, 0) energy is gained"
            ),
            Without(inelastic.name, BALL.with_values(E=[[2]], p=[3])),
            Without(complementary.name, BALL.with_values(p=[3])),
        ),
        twins=(
            Twin(
                "every such impact conserves the energy",
                equation("KE⁺ = KE", after.T * M * after, v.T * M * v),
                BALL,
            ),
        ),
        remarks=(
            r"$\gamma^+ + E \gamma^- \geq 0$ and $e_i \geq 0$ belong to the law but are not needed for "
            r"passivity.",
            r"With one scalar $e$ the signs of $J v$ do not matter either: newton_lcp_equal.",
        ),
    )


def _skew():  # type: ignore[no-untyped-def]
    return instance(
        {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "E": [[0]], "p": [1], "v": [-1, 0]}
    )


def _mixed():  # type: ignore[no-untyped-def]
    """W = [1 −1/2; −1/2 1], p = −W⁻¹ (I + E) J v: both contacts push, both slacks are zero."""
    return instance(
        {
            "M": [["4/3", "2/3"], ["2/3", "4/3"]],
            "M⁻¹": [[1, "-1/2"], ["-1/2", 1]],
            "J": [[1, 0], [0, 1]],
            "E": [[1, 0], [0, 0]],
            "v": [-2, 1],
            "p": ["14/3", "4/3"],
        }
    )


def _pulling():  # type: ignore[no-untyped-def]
    """The bar: meeting both restitutions needs the second contact to pull."""
    return instance(
        {
            "M": [[1, 0], [0, "1/12"]],
            "M⁻¹": [[1, 0], [0, 12]],
            "J": [[1, "1/2"], [1, "2/5"]],
            "E": [[1, 0], [0, 0]],
            "v": [-1, 0],
            "p": ["61/3", "-70/3"],
        }
    )
