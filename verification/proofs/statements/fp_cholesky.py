"""Floating point 2: what Cholesky's backward error does to the energy. This is where κ enters."""

from verification.proofs.algebra import matrix, scalar, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term
from verification.proofs.vocabulary import M, v

CASE = instance({"M": [[1]], "Δ": [["1/2"]], "v": [1], "w": [1]}, η="1/2", g=0)

PLANE = CASE.with_values(
    {"M": [[1, 0], [0, 1]], "Δ": [["1/2", 0], [0, "-1/2"]], "v": [1, 0], "w": [0, "3/2"]}
)


def statement() -> Statement:
    error, after, eta, growth = matrix("Δ", "d", "d"), vector("w", "d"), scalar("η"), scalar("g")
    above = NonNegative("Δ ⪯ η M", eta * M - error)
    below = NonNegative("−Δ ⪯ η M", eta * M + error)
    factor = M + error
    kept = NonNegative(
        "in the metric of L Lᵀ = M + Δ the energy grows by at most 1 + g",
        (1 + growth) * v.T * factor * v - after.T * factor * after,
    )
    positive = NonNegative("g ≥ −1", 1 + growth)
    result = positivity(
        "(1−η) wᵀMw ≤ (1+g)(1+η) vᵀMv",
        (1 + growth) * (1 + eta) * v.T * M * v - (1 - eta) * after.T * M * after,
        (Term(1, (), kept), Term(1, (positive,), Square(v, above)), Term(1, (), Square(after, below))),
    )
    return Statement(
        name="fp_cholesky",
        title="Floating point: Cholesky's error costs the condition number",
        source="docs/theory.md; Higham (2002), Theorem 10.3",
        statement=(
            r"Let $L L^\top = M + \Delta$ with $-\eta M \leq \Delta \leq \eta M$. If the energy in the "
            r"metric $L L^\top$ grows by at most $1+g$, the true energy grows by at most "
            r"$(1+g)(1+\eta)/(1-\eta)$."
        ),
        given=(above, below, kept, positive),
        steps=(result,),
        concludes=(result.claim.name,),
        witness=CASE,
        needed=(
            Without(above.name, PLANE.with_values({"Δ": [[8, 0], [0, 0]], "w": [0, 3]})),
            Without(below.name, PLANE.with_values({"Δ": [[0, 0], [0, "-9/10"]], "w": [0, 3]})),
            Without(kept.name, CASE.with_values(w=[9])),
            Without(positive.name, CASE.with_values({"Δ": [[-1]], "w": [0], "η": 1, "g": -2})),
        ),
        twins=(
            Twin(
                "the error does not matter",
                NonNegative("wᵀMw ≤ (1+g) vᵀMv", (1 + growth) * v.T * M * v - after.T * M * after),
                PLANE,
                "the metric takes one direction for heavier and the other for lighter than it is",
            ),
        ),
        remarks=(
            r"Cholesky as computed has $|\Delta| \leq \gamma_{d+1} |L| |L^\top|$, hence $\|\Delta\| \leq "
            r"\gamma_{d+1} \, tr(L L^\top)$ and $\eta \leq d \gamma_{d+1} \kappa / (1 - d \gamma_{d+1})$ "
            r"(bounds.cholesky_error): about $d^2 u \kappa$, felt when $v$ lies near the light directions "
            r"of $M$.",
            r"The triangular solves add terms of order $d^{3/2} u \sqrt{\kappa}$ only "
            r"(bounds.unclamped_bound).",
        ),
    )
