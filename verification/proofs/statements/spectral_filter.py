"""Every filter that gives mode k a restitution between −1 and 1 is passive."""

from fractions import Fraction

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term

HALF = Fraction(1, 2)
CASE = instance(V=[[1, 0], [0, 1]], E=[["1/2", 0], [0, -1]], u=[1, 1])


def statement() -> Statement:
    modes, filter_, u, after = (
        matrix("V", "d", "k"),
        matrix("E", "k", "k"),
        vector("u", "d"),
        vector("u⁺", "d"),
    )
    orthonormal = equation("Vᵀ V = I", modes.T * modes, 1)
    symmetric = equation("E is symmetric", filter_.T, filter_)
    above, below = NonNegative("I + E ⪰ 0", 1 + filter_), NonNegative("I − E ⪰ 0", 1 - filter_)
    name = equation("the filtered impact", after, u - modes * (1 + filter_) * modes.T * u)
    s = modes.T * u
    rules = (name, name.T, orthonormal, symmetric)
    loss = identity(
        "twice the loss", u.T * u - after.T * after, s.T * (1 - filter_ * filter_) * s, rules, "with s = Vᵀ u"
    )
    plus, minus = (1 + filter_) * s, (1 - filter_) * s
    passive = positivity(
        "the kinetic energy does not grow",
        s.T * (1 - filter_ * filter_) * s,
        (Term(HALF, (), Square(plus, below)), Term(HALF, (), Square(minus, above))),
        rules,
        "2 (I − E²) = (I+E)(I−E)(I+E) + (I−E)(I+E)(I−E)",
    )
    return Statement(
        name="spectral_filter",
        title="Every spectral filter is passive",
        source="docs/theory.md (one family)",
        statement=(
            r"Let $V^\top V = I$ and $E = E^\top$ with $-I \leq E \leq I$. Then $u^+ = u - V (I+E) V^\top "
            r"u$ has $|u|^2 - |u^+|^2 = u^\top V (I - E^2) V^\top u \geq 0$. With $E$ diagonal mode $k$ has "
            r"its own restitution $e_k$: truncation ($e_k \in \{e, -1\}$), damping ($1 + e_k = (1+e) "
            r"\sigma_k^2 / (\sigma_k^2 + \lambda)$) and one scale factor are all of this kind."
        ),
        given=(orthonormal, symmetric, above, below),
        definitions=(name,),
        steps=(loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=CASE,
        needed=(
            Without(orthonormal.name, CASE.with_values(V=[[3, 0], [0, 1]])),
            Without(symmetric.name, CASE.with_values(E=[[0, 3], [-3, 0]])),
            Without(above.name, CASE.with_values(E=[[-2, 0], [0, 0]])),
            Without(below.name, CASE.with_values(E=[[2, 0], [0, 0]])),
        ),
        twins=(
            Twin(
                "modes need not be orthogonal: one factor per contact row",
                NonNegative("KE − KE⁺ for a skew row V E", u.T * u - _skewed(u, modes, filter_)),
                CASE.with_values(V=[[1, 0], [0, 1]], E=[[1, 0], [0, -1]], u=[1, 2]).with_values(
                    T=[[1, -2], [0, 1]]
                ),
            ),
        ),
        remarks=(
            "factors between −1 and 1 on rows that are not orthogonal are not passive, see scaled_impulse.",
        ),
    )


def _skewed(u, modes, filter_):  # type: ignore[no-untyped-def]
    """|u⁺|² when the modes are first sheared by T."""
    shear = matrix("T", "k", "k")
    after = u - modes * (1 + filter_) * shear * modes.T * u
    return after.T * after
