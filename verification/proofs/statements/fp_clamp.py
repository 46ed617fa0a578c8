"""Floating point 3: the clamp as computed, with X, Y and α each rounded."""

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Term

CASE = instance({"α": 1, "x": -1, "y": 2, "X": -1, "Y": 2, "h": 0}, u="1/8")


def statement() -> Statement:
    alpha, x, y, cross, square, slack, u = (scalar(name) for name in ("α", "x", "y", "X", "Y", "h", "u"))
    cross_near = NonNegative("x ≤ (1−u) X + h: X was rounded once", (1 - u) * cross + slack - x)
    square_near = NonNegative("(1−u) y ≤ Y: Y was rounded once", square - (1 - u) * y)
    quotient = NonNegative("(1−u) α Y ≤ −2X: α was rounded once", -2 * cross - (1 - u) * alpha * square)
    positive, unit = NonNegative("α ≥ 0", alpha), NonNegative("u ≤ 1", 1 - u)
    bound = 2 * alpha * slack + alpha * alpha * ((2 * u - u * u) * square + u * y)
    result = positivity(
        "2αx + α²y ≤ 2αh + α² ((2u − u²) Y + u y)",
        bound - 2 * alpha * x - alpha * alpha * y,
        (
            Term(2, (positive, cross_near)),
            Term(1, (positive, unit, quotient)),
            Term(1, (positive, positive, square_near)),
        ),
    )
    return Statement(
        name="fp_clamp",
        title="Floating point: what the clamp leaves",
        source="docs/theory.md (energy clamp)",
        statement=(
            r"Let $x = v^\top M \Delta$, $y = \Delta^\top M \Delta$, and let $X < 0$, $Y$ be their computed "
            r"values and $\alpha \leq -2X/Y$ up to one rounding. Then twice the energy gained, $2 \alpha x "
            r"+ \alpha^2 y$, is at most $2 \alpha h + \alpha^2 ((2u - u^2) Y + u y)$, about $3 u \alpha^2 y "
            r"+ 2 \alpha h$."
        ),
        given=(cross_near, square_near, quotient, positive, unit),
        steps=(result,),
        concludes=(result.claim.name,),
        witness=CASE,
        needed=(
            Without(cross_near.name, CASE.with_values(x=1)),
            Without(square_near.name, CASE.with_values(y=9)),
            Without(quotient.name, CASE.with_values(α=9)),
            Without(positive.name, CASE.with_values(α=-1)),
            Without(unit.name, CASE.with_values(u=3, x=20, X=-10, Y=0, y=0)),
        ),
        twins=(
            Twin(
                "nothing is left",
                NonNegative("2αx + α²y ≤ 0", -2 * alpha * x - alpha * alpha * y),
                CASE.with_values(x="-7/8"),
                "X rounded towards the larger magnitude",
            ),
        ),
        remarks=(
            r"As $\alpha \leq 2 \|v\| / \|\Delta\|$ up to rounding, $\alpha^2 y \leq 4 \|v\|^2$: a relative "
            r"gain of $12 u$ plus $12 \tau$ for the double-double sums, $h \leq \tau \|v\| \|\Delta\|$ "
            r"(bounds.gain_bound).",
        ),
    )
