"""The anytime form: every truncation of the factored form is passive, and the work still missing is known."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term
from verification.proofs.vocabulary import E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE, e

CASE = instance({"Q₁": [[1], [0]], "Q₂": [[0], [1]], "u": [1, 1]}, e=0)


def statement() -> Statement:
    q1, q2, u = matrix("Q₁", "d", "k"), matrix("Q₂", "d", "m"), vector("u", "d")
    early, full = vector("u₁", "d"), vector("u₂", "d")
    names = (
        equation("stopped early", early, u - (1 + e) * q1 * q1.T * u),
        equation("complete", full, u - (1 + e) * (q1 * q1.T * u + q2 * q2.T * u)),
    )
    unit1, unit2 = equation("Q₁ᵀ Q₁ = I", q1.T * q1, 1), equation("Q₂ᵀ Q₂ = I", q2.T * q2, 1)
    across = equation("Q₁ᵀ Q₂ = 0", q1.T * q2, 0)
    rules = (*names, *(name.T for name in names), unit1, unit2, across, across.T)
    s1, s2 = q1.T * u, q2.T * u
    loss = identity(
        "twice the loss when stopped early", u.T * u - early.T * early, (1 - e * e) * s1.T * s1, rules
    )
    range_ = (E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE)
    passive = positivity("stopped early is passive", loss.claim.rhs, (Term(1, range_, Square(s1)),), rules)
    missing = identity(
        "distance from the complete answer",
        (early - full).T * (early - full),
        (1 + e) * (1 + e) * s2.T * s2,
        rules,
        "only the rows that were left out count",
    )
    monotone = positivity(
        "more rows never lose less energy",
        early.T * early - full.T * full,
        (Term(1, range_, Square(s2)),),
        rules,
    )
    steps = (loss, passive, missing, monotone)
    return Statement(
        name="any_truncation",
        title="Every truncation is passive",
        source="docs/theory.md (anytime)",
        statement=(
            r"Let $Q = (Q_1 \; Q_2)$ have orthonormal columns. Stopping after $Q_1$ gives $u_1 = u - (1+e) "
            r"Q_1 Q_1^\top u$ with $|u|^2 - |u_1|^2 = (1-e^2) |Q_1^\top u|^2 \geq 0$, whatever the rows "
            r"left out are; its distance from the complete answer is exactly $(1+e) |Q_2^\top u|$."
        ),
        given=(unit1, unit2, across, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=names,
        steps=steps,
        concludes=tuple(step.claim.name for step in steps),
        witness=CASE,
        needed=(
            Without(unit1.name, CASE.with_values({"Q₁": [[2], [0]]})),
            Without(unit2.name, CASE.with_values({"Q₂": [[0], [2]]})),
            Without(across.name, CASE.with_values({"Q₂": [["3/5"], ["4/5"]]}, e=1)),
            Without(E_AT_MOST_ONE.name, CASE.with_values(e=2)),
            Without(E_AT_LEAST_MINUS_ONE.name, CASE.with_values(e=-2)),
        ),
        twins=(
            Twin(
                "the complete answer is reached with the first rows alone",
                equation("u₁ = u₂", early, full),
                CASE,
            ),
        ),
        remarks=("This needs no rank decision: any orthonormal Q₁ will do, even one that holds noise.",),
    )
