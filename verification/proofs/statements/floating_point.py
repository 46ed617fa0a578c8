"""Floating point: from the computed projector to the guaranteed 10 d ε √κ, and why (20) has no such bound."""

from __future__ import annotations

from fractions import Fraction

from verification.proofs.algebra import NonNegative, equation, matrix, scalar, vector
from verification.proofs.exact import instance
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Exact, Square, Term, positivity
from verification.proofs.vocabulary import E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE, M, e, v

FP_PROJECTOR_CASE = instance(Q=[[1]], u=[1], δ="1/4", e=1)


def fp_projector() -> Statement:
    """Floating point 1: the gain of a projector with a nearly orthonormal basis. No condition number occurs."""
    q, u, after, delta = matrix("Q", "d", "r"), vector("u", "d"), vector("u⁺", "d"), scalar("δ")
    name = equation("the computed impact", after, u - (1 + e) * q * q.T * u)
    near = NonNegative("Qᵀ Q ⪯ (1 + δ) I", 1 + delta - q.T * q)
    small = NonNegative("δ ≥ 0", delta)
    s = q.T * u
    range_ = (E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE)
    both = (E_AT_LEAST_MINUS_ONE, E_AT_LEAST_MINUS_ONE)
    first = positivity(
        "|u⁺|² ≤ |u|² + (1+e)² δ |Qᵀu|²",
        u.T * u + (1 + e) * (1 + e) * delta * s.T * s - after.T * after,
        (Term(1, range_, Square(s)), Term(1, both, Square(s, near))),
        (name, name.T),
    )
    second = positivity(
        "(1+δ) |Qᵀu|² ≤ (1+δ)² |u|²",
        (1 + delta) * (1 + delta) * u.T * u - (1 + delta) * s.T * s,
        (Term(1, (), Square((1 + delta) * u - q * s)), Term(1, (), Square(s, near))),
    )
    bound = (1 + delta) * (1 + (1 + e) * (1 + e) * delta * (1 + delta))
    third = positivity(
        "|u⁺|² ≤ (1 + (1+e)² δ (1+δ)) |u|², times 1 + δ",
        bound * u.T * u - (1 + delta) * after.T * after,
        (Term(1, (), first.claim), Term(1, (small,), first.claim), Term(1, (*both, small), second.claim)),
    )
    return Statement(
        title="Floating point: the energy error of the projector does not depend on conditioning",
        source="docs/theory.md",
        statement=(
            r"Let $Q^\top Q \leq (1+\delta) I$. Then $u^+ = u - (1+e) Q Q^\top u$ has $|u^+|^2 \leq (1 + (1+e)^2 "
            r"\delta (1+\delta)) |u|^2 \leq (1 + 4 \delta (1+\delta)) |u|^2$ for $e \in [-1, 1]$. Neither $M$ nor $J$ "
            r"nor any rank decision enters."
        ),
        given=(near, small, *range_),
        definitions=(name,),
        steps=(first, second, third),
        concludes=(first.claim.name, third.claim.name),
        witness=FP_PROJECTOR_CASE,
        needed=(
            Without(near.name, FP_PROJECTOR_CASE.with_values(Q=[[3]])),
            Without(small.name, FP_PROJECTOR_CASE.with_values(Q=[[0]], δ="-1/2")),
            Without(E_AT_LEAST_MINUS_ONE.name, FP_PROJECTOR_CASE.with_values(e=-3)),
            Without(E_AT_MOST_ONE.name, FP_PROJECTOR_CASE.with_values(δ=0, e=2)),
        ),
        twins=(
            Twin(
                "the energy never grows, however Q was rounded",
                NonNegative("|u⁺|² ≤ |u|²", u.T * u - after.T * after),
                FP_PROJECTOR_CASE.with_values(Q=[["9/8"]], δ="17/64"),
                "a basis vector too long by 1/8",
            ),
        ),
        assumed=(
            r"$\delta$ of the basis as computed: re-orthogonalised Gram-Schmidt under the standard model of rounding, "
            r"by hand (bounds.orthogonality_bound).",
        ),
        measured=(
            r"Products with bases of $d = 2, 5, 12$ in numpy, judged in exact fractions, stay below "
            r"bounds.projector_bound; the compiled basis is measured with all the rest, under fp_promise.",
        ),
        remarks=(
            r"With $\|Q^\top Q - I\| \leq \delta$ measured or bounded (bounds.orthogonality_bound: about $9 d^{5/2} "
            r"u$ for a re-orthogonalised basis) and the rounding of the two products, $2(\gamma_d + \gamma_{d+2} + "
            r"u)\sqrt{d}$, this is bounds.projector_bound: a constant that depends on $d$ only.",
        ),
    )


FP_CHOLESKY_CASE = instance({"M": [[1]], "Δ": [["1/2"]], "v": [1], "w": [1]}, η="1/2", g=0)

PLANE = FP_CHOLESKY_CASE.with_values(
    {"M": [[1, 0], [0, 1]], "Δ": [["1/2", 0], [0, "-1/2"]], "v": [1, 0], "w": [0, "3/2"]}
)


def fp_cholesky() -> Statement:
    """Floating point 2: the effect of Cholesky's backward error on the energy, which depends on κ."""
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
        title="Floating point: Cholesky's error costs the condition number",
        source="docs/theory.md; Higham (2002), Theorem 10.3",
        statement=(
            r"Let $L L^\top = M + \Delta$ with $-\eta M \leq \Delta \leq \eta M$. If the energy in the metric $L "
            r"L^\top$ grows by at most $1+g$, the true energy grows by at most $(1+g)(1+\eta)/(1-\eta)$."
        ),
        given=(above, below, kept, positive),
        steps=(result,),
        concludes=(result.claim.name,),
        witness=FP_CHOLESKY_CASE,
        needed=(
            Without(above.name, PLANE.with_values({"Δ": [[8, 0], [0, 0]], "w": [0, 3]})),
            Without(below.name, PLANE.with_values({"Δ": [[0, 0], [0, "-9/10"]], "w": [0, 3]})),
            Without(kept.name, FP_CHOLESKY_CASE.with_values(w=[9])),
            Without(positive.name, FP_CHOLESKY_CASE.with_values({"Δ": [[-1]], "w": [0], "η": 1, "g": -2})),
        ),
        twins=(
            Twin(
                "the error does not matter",
                NonNegative("wᵀMw ≤ (1+g) vᵀMv", (1 + growth) * v.T * M * v - after.T * M * after),
                PLANE,
                "in the perturbed metric one direction is too heavy and the other too light",
            ),
        ),
        assumed=(
            r"Cholesky's backward error $|\Delta| \leq \gamma_{d+1} |L| |L^\top|$: Higham (2002), Theorem 10.3, in "
            r"the standard model.",
        ),
        measured=(r"Without the clamp 10,000 adversarial impacts gain at most 0.05 of bounds.unclamped_bound.",),
        remarks=(
            r"Cholesky as computed has $|\Delta| \leq \gamma_{d+1} |L| |L^\top|$, hence $\|\Delta\| \leq \gamma_{d+1} "
            r"\, tr(L L^\top)$ and $\eta \leq d \gamma_{d+1} \kappa / (1 - d \gamma_{d+1})$ (bounds.cholesky_error): "
            r"about $d^2 u \kappa$, felt when $v$ lies near the light directions of $M$.",
            r"The triangular solves add terms of order $d^{3/2} u \sqrt{\kappa}$ only (bounds.unclamped_bound).",
        ),
    )


FP_CLAMP_CASE = instance({"α": 1, "x": -1, "y": 2, "X": -1, "Y": 2, "h": 0}, u="1/8")


def fp_clamp() -> Statement:
    """Floating point 3: the computed clamp, with X, Y and α each rounded."""
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
        title="Floating point: what the clamp leaves",
        source="docs/theory.md (energy clamp)",
        statement=(
            r"Let $x = v^\top M \Delta$, $y = \Delta^\top M \Delta$, and let $X < 0$, $Y$ be their computed values "
            r"and $\alpha \leq -2X/Y$ up to one rounding. Then twice the energy gained, $2 \alpha x + \alpha^2 y$, is "
            r"at most $2 \alpha h + \alpha^2 ((2u - u^2) Y + u y)$, about $3 u \alpha^2 y + 2 \alpha h$."
        ),
        given=(cross_near, square_near, quotient, positive, unit),
        steps=(result,),
        concludes=(result.claim.name,),
        witness=FP_CLAMP_CASE,
        needed=(
            Without(cross_near.name, FP_CLAMP_CASE.with_values(x=1)),
            Without(square_near.name, FP_CLAMP_CASE.with_values(y=9)),
            Without(quotient.name, FP_CLAMP_CASE.with_values(α=9)),
            Without(positive.name, FP_CLAMP_CASE.with_values(α=-1)),
            Without(unit.name, FP_CLAMP_CASE.with_values(u=3, x=20, X=-10, Y=0, y=0)),
        ),
        twins=(
            Twin(
                "nothing is left",
                NonNegative("2αx + α²y ≤ 0", -2 * alpha * x - alpha * alpha * y),
                FP_CLAMP_CASE.with_values(x="-7/8"),
                "X rounded towards the larger magnitude",
            ),
        ),
        assumed=(
            r"$X$, $Y$ and $\alpha$ are rounded once each, and the double-double sums behind them err by at most "
            r"$\tau \|v\| \|\Delta\|$: the standard model, error-free transformations, no over- or underflow.",
        ),
        remarks=(
            r"As $\alpha \leq 2 \|v\| / \|\Delta\|$ up to rounding, $\alpha^2 y \leq 4 \|v\|^2$: a relative gain of "
            r"$12 u$ plus $12 \tau$ for the double-double sums, $h \leq \tau \|v\| \|\Delta\|$ (bounds.gain_bound).",
        ),
    )


FP_ROUNDING_CASE = instance({"M": [[1, 0], [0, 4]], "v": [2, 0], "r": [0, 1], "κ": 4, "η": 1})
ROUND = instance({"M": [[1, 0], [0, 1]], "v": [1, 0], "r": [0, "1/2"], "κ": 1, "η": "1/2"})


def fp_rounding() -> Statement:
    """Floating point 4: rounding v⁺ to doubles causes an energy error proportional to √κ."""
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
        title="Floating point: rounding the returned velocity costs √κ",
        source="docs/theory.md",
        statement=(
            r"Scale the units so that $I \leq M \leq \kappa I$, and let $v$ be rounded to $v + r$ with $|r| \leq u "
            r"|v|$. With $\eta = u \sqrt{\kappa}$ the kinetic energy grows at most by the factor $(1+\eta)^2$, about "
            r"$1 + 2 u \sqrt{\kappa} = 1 + \epsilon \sqrt{\kappa}$."
        ),
        given=(lightest, heaviest, rounded, positive),
        steps=(metric, growth),
        concludes=(metric.claim.name, growth.claim.name),
        witness=FP_ROUNDING_CASE,
        needed=(
            Without(lightest.name, ROUND.with_values(M=[["1/100", 0], [0, 1]])),
            Without(heaviest.name, ROUND.with_values(M=[[1, 0], [0, 100]])),
            Without(rounded.name, ROUND.with_values(r=[0, 9])),
            Without(positive.name, ROUND.with_values(η=-2, r=[-1, 0])),
        ),
        twins=(
            Twin(
                "the energy grows by at most (1 + η/√κ)² = (1 + u)², independent of the condition number",
                NonNegative(
                    "(1 + η/10)² vᵀMv, here √κ = 10",
                    (10 + eta) * (10 + eta) * v.T * M * v - 100 * (v + r).T * M * (v + r),
                ),
                ROUND.with_values({"M": [[1, 0], [0, 100]], "κ": 100, "r": [0, "1/20"]}),
                "rounding in the heavy direction, motion in the light one",
            ),
        ),
        assumed=(
            r"Each component of $v^+$ is rounded to nearest, relative error at most $u = 2^{-53}$, and none is "
            r"subnormal.",
        ),
        remarks=(
            r"For $v^+ = fl(v + fl(\alpha \Delta))$ the same with $|r| \leq u |v^+| + u |\alpha \Delta|$ gives $\|r\| "
            r"\leq 3 u \sqrt{\kappa} \, \|v\|$, the term $6 u \sqrt{\kappa}$ of bounds.gain_bound.",
            r"All rounding is component by component, so $\kappa$ may be taken after the best scaling of the "
            r"coordinates.",
        ),
    )


def fp_promise() -> Statement:
    """Floating point 5: the sum of all terms is below the guaranteed 10 d ε √κ."""
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
        title="Floating point: the bound 10 d ε √κ",
        source="docs/theory.md",
        statement=(
            r"The bound of fp_clamp and fp_rounding, $(65/64)(12 + 6 \sqrt{\kappa}) u$, with what is left of second "
            r"order, is below $20 d u \sqrt{\kappa} = 10 d \epsilon \sqrt{\kappa}$ for every $d \geq 1$ and $\kappa "
            r"\geq 1$."
        ),
        given=(dimension, condition),
        steps=(at_least_zero, result),
        concludes=(result.claim.name,),
        witness=case,
        needed=(Without(dimension.name, case.with_values(d="1/2")), Without(condition.name, case.with_values(k="1/2"))),
        twins=(
            Twin(
                "half of the constant suffices in one dimension",
                NonNegative("5 d ε √κ", 10 * d * k - bound),
                case,
                "for d = 1 and κ = 1 the sum of the terms is 18.3 u",
            ),
        ),
        assumed=(
            r"The hypotheses of fp_clamp and fp_rounding, and that no other rounding enters: the derivation in "
            r"bounds.py, which people read and no machine checks.",
        ),
        measured=(
            r"The compiled kernel, with the last step that verification.laws.exact_energy judges, gains in none of "
            r"10,000,000 adversarial impacts ($d \leq 8$, $c \leq 8$, $\kappa(M) \leq 10^{12}$); on an AVX-512 "
            r"processor. Without the clamp, or by the printed formula, the promise is broken.",
        ),
        remarks=(
            r"The terms of second order, $13 \tau + 10 u^2 \kappa$, stay below $(55/32) u$ $\sqrt{\kappa}$ as long as "
            r"$\kappa \leq 10^{24}/d$: far beyond any mass matrix that Cholesky accepts.",
        ),
    )


SIZE = 2.0**-28  # distance of the second row from the direction of the first


def energy_factor(k: int) -> Fraction:
    """Return KE⁺/KE⁻ of an elastic impact with a rounded Delassus matrix W; all other quantities are exact.

    M = I, J = [1 0; a t] with a = 1 − 2⁻ᵏ, t = 2⁻²⁸, v = (0, 1). The entries of W are computed in doubles; its
    inverse, the impulse and v⁺ are rational.
    """
    a = 1.0 - 2.0**-k
    rounded = [[Fraction(1.0), Fraction(a)], [Fraction(a), Fraction(a * a + SIZE * SIZE)]]
    return _energy_after(Fraction(a), Fraction(SIZE), rounded)


def energy_factor_above_cutoff(ulps: int) -> Fraction:
    """Return KE⁺/KE⁻ as in `energy_factor` for a = 1 and t² = (ulps + 0.49) ε.

    The computed W keeps its rank above a cutoff of ulps ε/4.
    """
    t = ((ulps + 0.49) * 2.0**-52) ** 0.5
    rounded = [[Fraction(1), Fraction(1)], [Fraction(1), Fraction(1.0 + t * t)]]
    return _energy_after(Fraction(1), Fraction(t), rounded)


def _energy_after(a: Fraction, t: Fraction, w: list[list[Fraction]]) -> Fraction:
    determinant = w[0][0] * w[1][1] - w[0][1] * w[1][0]
    p = [2 * t * w[0][1] / determinant, -2 * t * w[0][0] / determinant]  # −2 W⁻¹ (0, t)
    after = (p[0] + a * p[1], 1 + t * p[1])
    return after[0] ** 2 + after[1] ** 2


def fp_gram_pinv() -> Statement:
    """Floating point 6: the printed formula, which forms J M⁻¹ Jᵀ, has no such bound."""
    one, cut = Fraction(1), energy_factor_above_cutoff(19)
    return Statement(
        title="Floating point: the printed formula has no such bound",
        source="paper (20)-(21); erratum 6",
        statement=(
            r"Let $M = I$, $J = \begin{pmatrix} 1 & 0 \\ 1 - 2^{-k} & 2^{-28} \end{pmatrix}$, $v = (0, 1)$, $e = 1$. "
            r"The last entry of $J J^\top$ rounds so that the computed matrix has the determinant $-2^{-2k}$ instead "
            r"of $2^{-56}$. Even with an exact inverse the energy is multiplied by $(1 + 2^{2k-55})^2$, up to $3 "
            r"\cdot 10^{29}$ for $k = 52$, at the same conditioning throughout ($\kappa(M) = 1$, $\kappa(J) \approx "
            r"2^{29}$). In exact arithmetic it is kept."
        ),
        steps=(
            *(
                Exact(f"energy after / before, k = {k}", energy_factor(k), "=", (1 + Fraction(2) ** (2 * k - 55)) ** 2)
                for k in (28, 32, 40, 52)
            ),
            Exact("k = 28: nine times the energy", energy_factor(28), "=", Fraction(9)),
            Exact(
                "with a cutoff of 1e-15: still a gain of a tenth", energy_factor_above_cutoff(19), ">", one + one / 10
            ),
            Exact("with a cutoff of 1e-12: a gain of 1e-4", energy_factor_above_cutoff(18100), ">", one + one / 10**4),
        ),
        twins=(
            Twin(
                "the gain is bounded by 10⁶ for this conditioning",
                Exact("k = 52", energy_factor(52), "≤", Fraction(10**6)),
            ),
            Twin("a cutoff of 1e-15 makes it passive", Exact("above the cutoff", cut, "≤", one)),
        ),
        assumed=(r"Nothing: the rounded entries of $W$ are those of doubles, and all that follows is rational.",),
        remarks=(
            r"A cutoff $\tau$ on the singular values of $W$ limits the gain to about $\epsilon / (2 \tau)$ for this "
            r"family, and buys it by ignoring every contact whose row is shorter than $\sqrt{\tau}$: a gain near "
            r"$\epsilon$ would need $\tau \approx 1$. The factored form never squares: its cutoff acts on the rows "
            r"themselves.",
        ),
    )
