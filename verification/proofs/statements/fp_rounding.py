"""Floating point 4: rounding v⁺ to doubles costs √κ, and no more."""

from verification.proofs.algebra import scalar, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term
from verification.proofs.vocabulary import M, v

CASE = instance({"M": [[1, 0], [0, 4]], "v": [2, 0], "r": [0, 1], "κ": 4, "η": 1})
ROUND = instance({"M": [[1, 0], [0, 1]], "v": [1, 0], "r": [0, "1/2"], "κ": 1, "η": "1/2"})


def statement() -> Statement:
    r, kappa, eta = vector("r", "d"), scalar("κ"), scalar("η")
    lightest, heaviest = NonNegative("M ⪰ I", M - 1), NonNegative("M ⪯ κ I", kappa - M)
    rounded = NonNegative("κ |r|² ≤ η² |v|²", eta * eta * v.T * v - kappa * r.T * r)
    positive = NonNegative("η ≥ 0", eta)
    metric = positivity(
        "rᵀMr ≤ η² vᵀMv",
        eta * eta * v.T * M * v - r.T * M * r,
        (Term(1, (), Square(eta * v, lightest)), Term(1, (), rounded), Term(1, (), Square(r, heaviest))),
    )
    young = eta * v - r
    growth = positivity(
        "the energy grows by at most (1+η)², times η",
        eta * ((1 + eta) * (1 + eta) * v.T * M * v - (v + r).T * M * (v + r)),
        (
            Term(1, (), Square(young, lightest)),
            Term(1, (), Square(young)),
            Term(1, (), metric.claim),
            Term(1, (positive,), metric.claim),
        ),
        because="Young's inequality in the metric M, by the square of η v − r",
    )
    return Statement(
        name="fp_rounding",
        title="Floating point: rounding the answer costs √κ",
        source="docs/theory.md",
        statement=(
            r"Scale the units so that $I \leq M \leq \kappa I$, and let $v$ be rounded to $v + r$ with $|r| "
            r"\leq u |v|$. With $\eta = u \sqrt{\kappa}$ the kinetic energy grows at most by the factor "
            r"$(1+\eta)^2$, about $1 + 2 u \sqrt{\kappa} = 1 + \epsilon \sqrt{\kappa}$."
        ),
        given=(lightest, heaviest, rounded, positive),
        steps=(metric, growth),
        concludes=(metric.claim.name, growth.claim.name),
        witness=CASE,
        needed=(
            Without(lightest.name, ROUND.with_values(M=[["1/100", 0], [0, 1]])),
            Without(heaviest.name, ROUND.with_values(M=[[1, 0], [0, 100]])),
            Without(rounded.name, ROUND.with_values(r=[0, 9])),
            Without(positive.name, ROUND.with_values(η=-2, r=[-1, 0])),
        ),
        twins=(
            Twin(
                "the energy grows by at most (1 + η/√κ)² = (1 + u)²: conditioning does not matter",
                NonNegative(
                    "(1 + η/10)² vᵀMv, here √κ = 10",
                    (10 + eta) * (10 + eta) * v.T * M * v - 100 * (v + r).T * M * (v + r),
                ),
                ROUND.with_values({"M": [[1, 0], [0, 100]], "κ": 100, "r": [0, "1/20"]}),
                "rounding in the heavy direction, motion in the light one",
            ),
        ),
        remarks=(
            r"For $v^+ = fl(v + fl(\alpha \Delta))$ the same with $|r| \leq u |v^+| + u |\alpha \Delta|$ "
            r"gives $\|r\| \leq 3 u \sqrt{\kappa} \, \|v\|$, the term $6 u \sqrt{\kappa}$ of "
            r"bounds.gain_bound.",
            r"All rounding is component by component, so $\kappa$ may be taken after the best scaling of "
            r"the coordinates.",
        ),
    )
