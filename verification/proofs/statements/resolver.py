"""Forms of the impact that a resolver may compute: projector, filter, damping, truncation, clamp."""

from __future__ import annotations

from fractions import Fraction

from verification.proofs.algebra import NonNegative, equation, matrix, scalar, vector
from verification.proofs.exact import instance
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Square, Term, identity, positivity
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_LEAST_MINUS_ONE,
    E_AT_MOST_ONE,
    INVERSE_MASS,
    INVERSE_SYMMETRIC,
    MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ONE,
    SYMMETRIC_MASS,
    G,
    J,
    M,
    W,
    e,
    v,
)

# M = 4, one wall reported twice: L = 2, A = (1/2, 1/2)ᵀ = C Qᵀ with Q = 1
PROJECTOR_FORM_CASE = instance(
    {
        "L": [[2]],
        "L⁻¹": [["1/2"]],
        "Q": [[1]],
        "C": [["1/2"], ["1/2"]],
        "D": [[1], [1]],
        "G": [[1, 1], [1, 1]],
        "v": [-1],
    },
    e="1/2",
)


def projector_form() -> Statement:
    """The resolver's form: an orthogonal projector in the coordinates u = Lᵀ v."""
    low, li, q = matrix("L", "d", "d"), matrix("L⁻¹", "d", "d"), matrix("Q", "d", "r")
    c, d, a, u = matrix("C", "c", "r"), matrix("D", "c", "r"), matrix("A", "c", "d"), vector("u", "d")
    names = (
        equation("mass matrix by its Cholesky factor", M, low * low.T),
        equation("its inverse", MI, li.T * li),
        equation("rows in the span of Q", a, c * q.T),
        equation("contact Jacobian: A = J L⁻ᵀ", J, a * low.T),
        equation("velocity in the kinetic metric", u, low.T * v),
    )
    orthonormal = equation("Qᵀ Q = I", q.T * q, 1)
    spanned = equation("Q lies in the span of the rows: Q = Aᵀ D", q, a.T * d)
    inverse = equation("G is a {1}-inverse of J M⁻¹ Jᵀ", W * G * W, W)
    left = equation("L⁻¹ L = I", li * low, 1)
    rules = (*names, *(name.T for name in names), orthonormal, left, left.T)
    unit = identity(
        "Dᵀ C = I",
        d.T * c,
        1,
        (names[2], names[2].T, orthonormal),
        "Qᵀ Q = Dᵀ A Q = Dᵀ C Qᵀ Q",
        first=(Cofactor(-ONE, spanned.T, q), Cofactor(ONE, orthonormal, ONE)),
    )
    core = identity(
        "Cᵀ G C = I",
        c.T * G * c,
        1,
        (*rules, unit.claim, unit.claim.T),
        "J M⁻¹ Jᵀ = C Cᵀ; multiply its {1}-inverse equation by Dᵀ and D",
        first=(Cofactor(d.T, inverse, d),),
    )
    projector = identity("Aᵀ G A = Q Qᵀ", a.T * G * a, q * q.T, (names[2], names[2].T, core.claim))
    impact = identity(
        "the impact (21) in u",
        low.T * (v - (1 + e) * MI * J.T * G * J * v),
        u - (1 + e) * q * q.T * u,
        (*rules, core.claim),
        "Lᵀ M⁻¹ Jᵀ G J v = Aᵀ G A u = Q Qᵀ u",
    )
    after = u - (1 + e) * q * q.T * u
    energy = identity(
        "the energy: |u|² − |u⁺|²", u.T * u - after.T * after, (1 - e * e) * u.T * q * q.T * u, (orthonormal,)
    )
    kinetic = identity("|u|² is twice the kinetic energy", u.T * u, v.T * M * v, rules)
    return Statement(
        title="The impact is an orthogonal projection",
        source="docs/theory.md; paper (21)",
        statement=(
            r"Let $M = L L^\top$, $u = L^\top v$, $A = J L^{-\top}$ and let the columns of $Q$ be an orthonormal "
            r"basis of the row space of $A$. Then (21) is $u^+ = u - (1+e) Q Q^\top u$ and $|u|^2 - |u^+|^2 = (1-e^2) "
            r"|Q^\top u|^2$. No Delassus matrix is formed."
        ),
        given=(orthonormal, spanned, inverse, left),
        definitions=names,
        steps=(unit, core, projector, impact, energy, kinetic),
        concludes=(projector.claim.name, impact.claim.name, energy.claim.name, kinetic.claim.name),
        witness=PROJECTOR_FORM_CASE,
        needed=(
            Without(orthonormal.name, PROJECTOR_FORM_CASE.with_values(Q=[[2]], C=[["1/4"], ["1/4"]], D=[[2], [2]])),
            Without(spanned.name, PROJECTOR_FORM_CASE.with_values(C=[[0], [0]], G=[[1, 0], [0, 1]])),
            Without(inverse.name, PROJECTOR_FORM_CASE.with_values(G=[[5, 0], [0, 5]])),
            Without(left.name, PROJECTOR_FORM_CASE.with_values(**{"L⁻¹": [[1]], "G": [["1/4"] * 2] * 2})),
        ),
        twins=(
            Twin(
                "Q Qᵀ may act on v itself",
                equation("(21) in v", v - (1 + e) * MI * J.T * G * J * v, v - (1 + e) * q * q.T * v),
                instance(
                    {
                        "L": [[1, 0], [1, 1]],
                        "L⁻¹": [[1, 0], [-1, 1]],
                        "Q": [[1], [0]],
                        "C": [[1]],
                        "D": [[1]],
                        "G": [[1]],
                        "v": [1, 1],
                    },
                    e=0,
                ),
            ),
        ),
    )


HALF = Fraction(1, 2)
SPECTRAL_FILTER_CASE = instance(V=[[1, 0], [0, 1]], E=[["1/2", 0], [0, -1]], u=[1, 1])


def spectral_filter() -> Statement:
    """Every filter that gives mode k a restitution between −1 and 1 is passive."""
    modes, filter_, u, after = (matrix("V", "d", "k"), matrix("E", "k", "k"), vector("u", "d"), vector("u⁺", "d"))
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
        title="Every spectral filter is passive",
        source="docs/theory.md (one family)",
        statement=(
            r"Let $V^\top V = I$ and $E = E^\top$ with $-I \leq E \leq I$. Then $u^+ = u - V (I+E) V^\top u$ has "
            r"$|u|^2 - |u^+|^2 = u^\top V (I - E^2) V^\top u \geq 0$. With $E$ diagonal mode $k$ has its own "
            r"restitution $e_k$: truncation ($e_k \in \{e, -1\}$), damping ($1 + e_k = (1+e) \sigma_k^2 / (\sigma_k^2 "
            r"+ \lambda)$) and one scale factor are all of this kind."
        ),
        given=(orthonormal, symmetric, above, below),
        definitions=(name,),
        steps=(loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=SPECTRAL_FILTER_CASE,
        needed=(
            Without(orthonormal.name, SPECTRAL_FILTER_CASE.with_values(V=[[3, 0], [0, 1]])),
            Without(symmetric.name, SPECTRAL_FILTER_CASE.with_values(E=[[0, 3], [-3, 0]])),
            Without(above.name, SPECTRAL_FILTER_CASE.with_values(E=[[-2, 0], [0, 0]])),
            Without(below.name, SPECTRAL_FILTER_CASE.with_values(E=[[2, 0], [0, 0]])),
        ),
        twins=(
            Twin(
                "modes need not be orthogonal: one factor per contact row",
                NonNegative("KE − KE⁺ for a skew row V E", u.T * u - _skewed(u, modes, filter_)),
                SPECTRAL_FILTER_CASE.with_values(V=[[1, 0], [0, 1]], E=[[1, 0], [0, -1]], u=[1, 2]).with_values(
                    T=[[1, -2], [0, 1]]
                ),
            ),
        ),
        remarks=("factors between −1 and 1 on rows that are not orthogonal are not passive, see scaled_impulse.",),
    )


def _skewed(u, modes, filter_):  # type: ignore[no-untyped-def]
    """Return |u⁺|² after a shear T of the modes."""
    shear = matrix("T", "k", "k")
    after = u - modes * (1 + filter_) * shear * modes.T * u
    return after.T * after


DAMPED_IMPACT_CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "X": [["1/2"]], "v": [-1]}, λ=1, e=0)


def damped_impact() -> Statement:
    """Damping: (W + λ I)⁻¹ instead of the pseudo-inverse is passive, but breaks Newton's law."""
    x, lam, after = matrix("X", "c", "c"), scalar("λ"), vector("v⁺", "d")
    inverse = equation("X = (J M⁻¹ Jᵀ + λ I)⁻¹", (W + lam) * x, 1)
    positive = NonNegative("λ ≥ 0", lam)
    name = equation("the damped impact", after, v - (1 + e) * MI * J.T * x * J * v)
    symmetric = identity(
        "X is symmetric",
        x.T,
        x,
        (INVERSE_SYMMETRIC.claim,),
        "X = (W + λ) Xᵀ X transposed, as for every inverse of a symmetric matrix",
        first=(Cofactor(-x.T, inverse, ONE), Cofactor(ONE, inverse.T, x)),
    )
    y = x * J * v
    split = identity(
        "X = X W X + λ X²", x.T, x * W * x + lam * x * x, (symmetric.claim,), first=(Cofactor(-x, inverse, ONE),)
    )
    loss = v.T * M * v - after.T * M * after
    rules = (name, name.T, *MASS_RULES)
    form = identity(
        "twice the loss of kinetic energy",
        loss,
        (1 + e) * (1 - e) * y.T * W * y + 2 * (1 + e) * lam * y.T * y,
        (*rules, symmetric.claim),
        "2 X − (1+e) X W X = (1−e) X W X + 2 λ X²",
        first=(Cofactor(2 * (1 + e) * v.T * J.T, split.claim, J * v),),
    )
    passive = positivity(
        "the kinetic energy does not grow",
        form.claim.rhs,
        (
            Term(1, (E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE), Square(MI * J.T * y, DEFINITE_MASS)),
            Term(2, (E_AT_LEAST_MINUS_ONE, positive), Square(y)),
        ),
        (*MASS_RULES, symmetric.claim),
    )
    return Statement(
        title="The damped impact is passive",
        source="docs/theory.md (damping); a spectral filter with its own certificate",
        statement=(
            r"With $X = (W + \lambda I)^{-1}$, $\lambda \geq 0$, and $v^+ = v - (1+e) M^{-1} J^\top X J v$ twice the "
            r"loss is $(1-e^2) \, y^\top W y + 2 (1+e) \lambda \, y^\top y \geq 0$ with $y = X J v$, for every $e \in "
            r"[-1, 1]$."
        ),
        given=(*MASS, inverse, positive, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=(name,),
        steps=(*MASS_LEMMAS, symmetric, split, form, passive),
        concludes=(form.claim.name, passive.claim.name),
        witness=DAMPED_IMPACT_CASE,
        needed=(
            Without(SYMMETRIC_MASS.name, _skew()),
            Without(INVERSE_MASS.name, DAMPED_IMPACT_CASE.with_values(M=[[2]])),
            Without(DEFINITE_MASS.name, DAMPED_IMPACT_CASE.with_values({"M": [[-1]], "M⁻¹": [[-1]], "X": [[-1]]}, λ=0)),
            Without(inverse.name, DAMPED_IMPACT_CASE.with_values(X=[[3]])),
            Without(positive.name, DAMPED_IMPACT_CASE.with_values({"X": [[4]], "λ": "-3/4"})),
            Without(E_AT_MOST_ONE.name, DAMPED_IMPACT_CASE.with_values(e=4)),
            Without(E_AT_LEAST_MINUS_ONE.name, DAMPED_IMPACT_CASE.with_values(e=-2)),
        ),
        twins=(
            Twin(
                "Newton's law is still met",
                equation("J v⁺ = −e J v", J * after, -e * J * v),
                DAMPED_IMPACT_CASE,
                "with λ = W half of the approach velocity is left after a plastic impact",
            ),
        ),
    )


def _skew():  # type: ignore[no-untyped-def]
    return instance({"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "X": [[1]], "v": [1, 0]}, λ=0, e=0)


ANY_TRUNCATION_CASE = instance({"Q₁": [[1], [0]], "Q₂": [[0], [1]], "u": [1, 1]}, e=0)


def any_truncation() -> Statement:
    """The anytime form: every truncation of the factored form is passive at a known distance from the full answer."""
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
    loss = identity("twice the loss when stopped early", u.T * u - early.T * early, (1 - e * e) * s1.T * s1, rules)
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
        "more rows never lose less energy", early.T * early - full.T * full, (Term(1, range_, Square(s2)),), rules
    )
    steps = (loss, passive, missing, monotone)
    return Statement(
        title="Every truncation is passive",
        source="docs/theory.md (anytime)",
        statement=(
            r"Let $Q = (Q_1 \; Q_2)$ have orthonormal columns. Stopping after $Q_1$ gives $u_1 = u - (1+e) Q_1 "
            r"Q_1^\top u$ with $|u|^2 - |u_1|^2 = (1-e^2) |Q_1^\top u|^2 \geq 0$, whatever the rows left out are; its "
            r"distance from the complete answer is exactly $(1+e) |Q_2^\top u|$."
        ),
        given=(unit1, unit2, across, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=names,
        steps=steps,
        concludes=tuple(step.claim.name for step in steps),
        witness=ANY_TRUNCATION_CASE,
        needed=(
            Without(unit1.name, ANY_TRUNCATION_CASE.with_values({"Q₁": [[2], [0]]})),
            Without(unit2.name, ANY_TRUNCATION_CASE.with_values({"Q₂": [[0], [2]]})),
            Without(across.name, ANY_TRUNCATION_CASE.with_values({"Q₂": [["3/5"], ["4/5"]]}, e=1)),
            Without(E_AT_MOST_ONE.name, ANY_TRUNCATION_CASE.with_values(e=2)),
            Without(E_AT_LEAST_MINUS_ONE.name, ANY_TRUNCATION_CASE.with_values(e=-2)),
        ),
        twins=(
            Twin(
                "the complete answer is reached with the first rows alone",
                equation("u₁ = u₂", early, full),
                ANY_TRUNCATION_CASE,
            ),
        ),
        remarks=("This needs no rank decision: any orthonormal Q₁ will do, even one that holds noise.",),
    )


# a mass at v = 1 for which a wrong solver returns −3: α = 1/2 gives −1
ENERGY_CLAMP_CASE = instance({"M": [[1]], "v": [1], "Δ": [-4]}, α="1/2")


def energy_clamp() -> Statement:
    """The energy clamp makes any candidate change of velocity passive and keeps the largest passive share of it."""
    change, alpha, after = vector("Δ", "d"), scalar("α"), vector("v⁺", "d")
    name = equation("the clamped velocity", after, v + alpha * change)
    slack = NonNegative("α is at most −2 (vᵀMΔ)/(ΔᵀMΔ)", -2 * v.T * M * change - alpha * change.T * M * change)
    positive = NonNegative("α ≥ 0", alpha)
    rules = (name, name.T)
    swap = (Cofactor(alpha * change.T, SYMMETRIC_MASS, v),)
    loss = identity(
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        alpha * slack.value,
        rules,
        "−2 α vᵀMΔ − α² ΔᵀMΔ, where ΔᵀMv = vᵀMΔ",
        first=swap,
    )
    passive = positivity(
        "the kinetic energy does not grow", loss.claim.rhs, (Term(1, (positive,), slack),), because="a product"
    )
    return Statement(
        title="The energy clamp",
        source="docs/theory.md (energy clamp)",
        statement=(
            r"Let $\Delta$ be any candidate change of velocity, and $0 \leq \alpha \leq -2 \, v^\top M \Delta / "
            r"\Delta^\top M \Delta$. Then $v^+ = v + \alpha \Delta$ loses $\frac12 \alpha \, (-2 v^\top M \Delta - "
            r"\alpha \Delta^\top M \Delta) \geq 0$. Where $v^\top M \Delta \geq 0$ there is no such $\alpha > 0$, and "
            r"$\alpha = 0$ is taken."
        ),
        given=(SYMMETRIC_MASS, positive, slack),
        definitions=(name,),
        steps=(loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=ENERGY_CLAMP_CASE,
        needed=(
            Without(SYMMETRIC_MASS.name, instance({"M": [[1, 1], [0, 1]], "v": [1, 0], "Δ": [0, -1]}, α=1)),
            Without(positive.name, ENERGY_CLAMP_CASE.with_values(α="-1/2")),
            Without(slack.name, ENERGY_CLAMP_CASE.with_values(α=1)),
        ),
        twins=(
            Twin(
                "the candidate may be taken whole",
                NonNegative("KE − KE of v + Δ", v.T * M * v - (v + change).T * M * (v + change)),
                ENERGY_CLAMP_CASE,
                "from 1 to −3: nine times the energy",
            ),
        ),
        remarks=(
            "M need not be definite, and nothing is divided by pᵀWp, which may be zero near the kernel of Jᵀ.",
            "A clamped impact is passive but may not meet Newton's law: contacts that still approach must be reported.",
        ),
    )
