"""Floating point 6: why no such bound exists for the printed formula, which forms J M⁻¹ Jᵀ."""

from fractions import Fraction

from verification.proofs.statement import Statement, Twin
from verification.proofs.steps import Exact

SIZE = 2.0**-28  # the second row leaves the first by this much


def energy_factor(k: int) -> Fraction:
    """KE⁺/KE⁻ of an elastic impact whose Delassus matrix alone is rounded; all else is exact.

    M = I, J = [1 0; a t] with a = 1 − 2⁻ᵏ, t = 2⁻²⁸, v = (0, 1). The entries of W are computed in doubles; its
    inverse, the impulse and v⁺ are rational.
    """
    a = 1.0 - 2.0**-k
    rounded = [[Fraction(1.0), Fraction(a)], [Fraction(a), Fraction(a * a + SIZE * SIZE)]]
    return _energy_after(Fraction(a), Fraction(SIZE), rounded)


def energy_factor_above_cutoff(ulps: int) -> Fraction:
    """The same for a = 1 and t² = (ulps + 0.49) ε: the computed W keeps its rank above a cutoff of ulps ε/4."""
    t = ((ulps + 0.49) * 2.0**-52) ** 0.5
    rounded = [[Fraction(1), Fraction(1)], [Fraction(1), Fraction(1.0 + t * t)]]
    return _energy_after(Fraction(1), Fraction(t), rounded)


def _energy_after(a: Fraction, t: Fraction, w: list[list[Fraction]]) -> Fraction:
    determinant = w[0][0] * w[1][1] - w[0][1] * w[1][0]
    p = [2 * t * w[0][1] / determinant, -2 * t * w[0][0] / determinant]  # −2 W⁻¹ (0, t)
    after = (p[0] + a * p[1], 1 + t * p[1])
    return after[0] ** 2 + after[1] ** 2


def statement() -> Statement:
    one, cut = Fraction(1), energy_factor_above_cutoff(19)
    return Statement(
        name="fp_gram_pinv",
        title="Floating point: the printed formula has no such bound",
        source="paper (20)-(21); erratum 6",
        statement=(
            r"Let $M = I$, $J = \begin{pmatrix} 1 & 0 \\ 1 - 2^{-k} & 2^{-28} \end{pmatrix}$, $v = (0, 1)$, "
            r"$e = 1$. The last entry of $J J^\top$ rounds so that the computed matrix has the determinant "
            r"$-2^{-2k}$ instead of $2^{-56}$. Even with an exact inverse the energy is multiplied by $(1 + "
            r"2^{2k-55})^2$, up to $3 \cdot 10^{29}$ for $k = 52$, at the same conditioning throughout "
            r"($\kappa(M) = 1$, $\kappa(J) \approx 2^{29}$). In exact arithmetic it is kept."
        ),
        steps=(
            *(
                Exact(
                    f"energy after / before, k = {k}",
                    energy_factor(k),
                    "=",
                    (1 + Fraction(2) ** (2 * k - 55)) ** 2,
                )
                for k in (28, 32, 40, 52)
            ),
            Exact("k = 28: nine times the energy", energy_factor(28), "=", Fraction(9)),
            Exact(
                "with a cutoff of 1e-15: still a gain of a tenth",
                energy_factor_above_cutoff(19),
                ">",
                one + one / 10,
            ),
            Exact(
                "with a cutoff of 1e-12: a gain of 1e-4",
                energy_factor_above_cutoff(18100),
                ">",
                one + one / 10**4,
            ),
        ),
        twins=(
            Twin(
                "the gain is bounded by 10⁶ for this conditioning",
                Exact("k = 52", energy_factor(52), "≤", Fraction(10**6)),
            ),
            Twin(
                "a cutoff of 1e-15 makes it passive",
                Exact("above the cutoff", cut, "≤", one),
            ),
        ),
        remarks=(
            r"A cutoff $\tau$ on the singular values of $W$ limits the gain to about $\epsilon / (2 \tau)$ "
            r"for this family, and buys it by ignoring every contact whose row is shorter than "
            r"$\sqrt{\tau}$: a gain near $\epsilon$ would need $\tau \approx 1$. The factored form never "
            r"squares: its cutoff acts on the rows themselves.",
        ),
    )
