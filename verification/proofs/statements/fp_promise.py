"""Floating point 5: the sum of all terms is below the promised 10 d ε √κ."""

from fractions import Fraction

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Term


def statement() -> Statement:
    d, k = scalar("d"), scalar("k")
    dimension, condition = NonNegative("d ≥ 1", d - 1), NonNegative("k = √κ ≥ 1", k - 1)
    at_least_zero = positivity("k ≥ 0", k, (Term(1, (condition,)), Term(1)))
    bound = Fraction(65, 64) * (12 + 6 * k)
    rest = Fraction(55, 32)
    result = positivity(
        "(65/64)(12 + 6k) + 55/32 ≤ 20 d k",
        20 * d * k - bound - rest,
        (Term(20, (dimension, at_least_zero.claim)), Term(Fraction(445, 32), (condition,))),
        because="in units of u = ε/2; 55/32 is left for the terms in u² κ",
    )
    case = instance(d=1, k=1)
    return Statement(
        name="fp_promise",
        title="Floating point: the promised bound 10 d ε √κ",
        source="docs/theory.md",
        statement=(
            r"The bound of fp_clamp and fp_rounding, $(65/64)(12 + 6 \sqrt{\kappa}) u$, with what is left "
            r"of second order, is below $20 d u \sqrt{\kappa} = 10 d \epsilon \sqrt{\kappa}$ for every $d "
            r"\geq 1$ and $\kappa \geq 1$."
        ),
        given=(dimension, condition),
        steps=(at_least_zero, result),
        concludes=(result.claim.name,),
        witness=case,
        needed=(
            Without(dimension.name, case.with_values(d="1/2")),
            Without(condition.name, case.with_values(k="1/2")),
        ),
        twins=(
            Twin(
                "half of the promised constant would do in one dimension",
                NonNegative("5 d ε √κ", 10 * d * k - bound),
                case,
                "for d = 1 and κ = 1 the sum of the terms is 18.3 u",
            ),
        ),
        remarks=(
            r"The terms of second order, $13 \tau + 10 u^2 \kappa$, stay below $(55/32) u$ $\sqrt{\kappa}$ "
            r"as long as $\kappa \leq 10^{24}/d$: far beyond any mass matrix that Cholesky accepts.",
        ),
    )
