"""A restitution for each contact, by equalities: the exact condition, and the bar that breaks it."""

from fractions import Fraction

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.linear import delassus, impact_case, inverse
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Exact
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
    v,
)

BAR_MASS, BAR_ROWS = [[1, 0], [0, Fraction(1, 12)]], [[1, "1/2"], [1, "2/5"]]
CASE = instance(
    {"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "W⁻¹": [[1]], "E": [["1/2"]], "v": [-1], "γ": [-1]},
)


def statement() -> Statement:
    wi, law_matrix = matrix("W⁻¹", "c", "c"), matrix("E", "c", "c")
    gamma, after = vector("γ", "c"), vector("v⁺", "d")
    inverse_ = equation("W W⁻¹ = I for W = J M⁻¹ Jᵀ", W * wi, 1)
    name = equation(
        "the impact with a restitution matrix", after, v - MI * J.T * wi * (1 + law_matrix) * J * v
    )
    symmetric = identity(
        "W⁻¹ is symmetric",
        wi.T,
        wi,
        (INVERSE_SYMMETRIC.claim,),
        "an inverse of a symmetric matrix",
        first=(Cofactor(-wi.T, inverse_, ONE), Cofactor(ONE, inverse_.T, wi)),
    )
    rules = (name, name.T, *MASS_RULES, symmetric.claim, inverse_)
    law = identity("each contact has its own restitution", J * after, -law_matrix * J * v, rules)
    loss = identity(
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        v.T * J.T * (wi - law_matrix.T * wi * law_matrix) * J * v,
        rules,
        "the terms linear in E cancel because W⁻¹ is symmetric",
    )
    reached = identity(
        "every γ occurs: v = M⁻¹ Jᵀ W⁻¹ γ has J v = γ", J * (MI * J.T * wi * gamma), gamma, (inverse_,)
    )
    steps = (law, loss, reached)
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "W⁻¹": [[1]], "v": [1, 0]}
    return Statement(
        name="unequal_restitution",
        title="Unequal restitution by equalities: the exact condition",
        source="docs/theory.md; the paper's future work",
        statement=(
            r"Let $W = J M^{-1} J^\top$ be invertible and $v^+ = v - M^{-1} J^\top W^{-1} (I+E) J v$. Then "
            r"$J v^+ = -E J v$ and twice the loss is $\gamma^\top (W^{-1} - E^\top W^{-1} E) \gamma$ with "
            r"$\gamma = J v$. Every $\gamma$ occurs, so the law is passive for all velocities if and only "
            r"if $W^{-1} - E^\top W^{-1} E \succeq 0$. For $E = e I$ this is $e \in [-1, 1]$; for unequal "
            r"$e_i$ it ties them to the masses."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS, inverse_),
        definitions=(name,),
        steps=(*MASS_LEMMAS, symmetric, *steps, *_bar()),
        concludes=tuple(step.claim.name for step in steps),
        witness=CASE,
        needed=(
            Without(SYMMETRIC_MASS.name, CASE.with_values(skew)),
            Without(INVERSE_MASS.name, CASE.with_values(M=[[2]])),
            Without(inverse_.name, CASE.with_values({"W⁻¹": [[3]]})),
        ),
        twins=(
            Twin(
                "restitutions between 0 and 1 suffice: the bar",
                NonNegative("KE⁺ ≤ KE", v.T * M * v - after.T * M * after),
                _bar_case(),
                "a bar (m = 1, I = 1/12) struck at 0.5 and 0.4 with e = (1, 0): 1/2 J become 73/6 J",
            ),
        ),
    )


def _bar_case():  # type: ignore[no-untyped-def]
    case = impact_case(BAR_MASS, BAR_ROWS, [-1, 0], E=[[1, 0], [0, 0]], γ=[-1, -1])
    return case.with_values({"W⁻¹": inverse(delassus(BAR_MASS, BAR_ROWS))})


def _bar() -> tuple[Exact, ...]:
    """The bar's energies from its velocities: before (−1, 0), after with J v⁺ = (1, 0)."""
    spin = Fraction(1) / (Fraction(1, 2) - Fraction(2, 5))
    speed = -Fraction(2, 5) * spin
    after = speed**2 / 2 + spin**2 / 24
    return (
        Exact("the bar's energy after, from v⁺ = (−4, 10)", after, "=", Fraction(73, 6)),
        Exact("is more than before", after, ">", Fraction(1, 2)),
    )
