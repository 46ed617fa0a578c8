"""Impact laws: unequal restitution, complementarity, Poisson's law, momentum."""

from __future__ import annotations

from fractions import Fraction

from verification.proofs.algebra import Entrywise, NonNegative, equation, matrix, scalar, vector
from verification.proofs.exact import delassus, impact_case, instance, inverse
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Exact, Pairing, Square, Term, identity, positivity
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_MOST_ONE,
    INVERSE_MASS,
    INVERSE_SYMMETRIC,
    MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ONE,
    SYMMETRIC_MASS,
    J,
    M,
    W,
    e,
    v,
)

BAR_MASS, BAR_ROWS = [[1, 0], [0, Fraction(1, 12)]], [[1, "1/2"], [1, "2/5"]]
CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "W⁻¹": [[1]], "E": [["1/2"]], "v": [-1], "γ": [-1]})


def unequal_restitution() -> Statement:
    """One restitution per contact, as equalities: the exact condition for passivity, and a bar that violates it."""
    wi, law_matrix = matrix("W⁻¹", "c", "c"), matrix("E", "c", "c")
    gamma, after = vector("γ", "c"), vector("v⁺", "d")
    inverse_ = equation("W W⁻¹ = I for W = J M⁻¹ Jᵀ", W * wi, 1)
    name = equation("the impact with a restitution matrix", after, v - MI * J.T * wi * (1 + law_matrix) * J * v)
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
    reached = identity("every γ occurs: v = M⁻¹ Jᵀ W⁻¹ γ has J v = γ", J * (MI * J.T * wi * gamma), gamma, (inverse_,))
    steps = (law, loss, reached)
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "W⁻¹": [[1]], "v": [1, 0]}
    return Statement(
        title="Unequal restitution by equalities: the exact condition",
        source="docs/theory.md; the paper's future work",
        statement=(
            r"Let $W = J M^{-1} J^\top$ be invertible and $v^+ = v - M^{-1} J^\top W^{-1} (I+E) J v$. Then $J v^+ = "
            r"-E J v$ and twice the loss is $\gamma^\top (W^{-1} - E^\top W^{-1} E) \gamma$ with $\gamma = J v$. "
            r"Every $\gamma$ occurs, so the law is passive for all velocities if and only if $W^{-1} - E^\top W^{-1} "
            r"E \succeq 0$. For $E = e I$ this is $e \in [-1, 1]$; for unequal $e_i$ it ties them to the masses."
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
    """Return the bar's energies from its velocities: before the impact (−1, 0), after it with J v⁺ = (1, 0)."""
    spin = Fraction(1) / (Fraction(1, 2) - Fraction(2, 5))
    speed = -Fraction(2, 5) * spin
    after = speed**2 / 2 + spin**2 / 24
    return (
        Exact("the bar's energy after, from v⁺ = (−4, 10)", after, "=", Fraction(73, 6)),
        Exact("is more than before", after, ">", Fraction(1, 2)),
    )


NEWTON_LCP_BALL = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "E": [[0]], "p": [1], "v": [-1]})


def newton_lcp() -> Statement:
    """Newton's law as a complementarity problem is passive if every contact approaches."""
    restitution, p, after = matrix("E", "c", "c"), vector("p", "c"), vector("v⁺", "d")
    name = equation("momentum balance", after, v + MI * J.T * p)
    pushes, approaching = Entrywise("p pushes", p), Entrywise("every contact approaches: −J v ≥ 0", -J * v)
    inelastic = Entrywise("I − E ≥ 0", 1 - restitution)
    complementary = equation("p ⟂ J v⁺ + E J v", p.T * (J * after + restitution * J * v), 0)
    steps_ = identity(
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        p.T * (1 - restitution) * (-J * v),
        (name, name.T, *MASS_RULES),
        "the loss is −pᵀ(J v + J v⁺), and pᵀ J v⁺ = −pᵀ E J v",
        first=(Cofactor(-ONE, complementary, ONE),),
    )
    passive = positivity(
        "the kinetic energy does not grow", steps_.claim.rhs, (Term(1, (), Pairing(pushes, approaching, inelastic)),)
    )
    return Statement(
        title="The Newton LCP is passive when all its contacts approach",
        source="docs/theory.md (unequal restitution); Moreau",
        statement=(
            r"Let $v^+ = v + M^{-1} J^\top p$ with $p \geq 0$, $p^\top (J v^+ + E J v) = 0$, $J v \leq 0$ and $E$ "
            r"diagonal with $e_i \leq 1$. Then twice the loss is $p^\top (I - E)(-J v) \geq 0$."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS, pushes, approaching, inelastic, complementary),
        definitions=(name,),
        steps=(*MASS_LEMMAS, steps_, passive),
        concludes=(steps_.claim.name, passive.claim.name),
        witness=NEWTON_LCP_BALL,
        needed=(
            Without(SYMMETRIC_MASS.name, _skew()),
            Without(INVERSE_MASS.name, NEWTON_LCP_BALL.with_values(M=[[2]])),
            Without(pushes.name, _pulling(), "an adhesive contact"),
            Without(approaching.name, _mixed(), "contact 2 separates already: with e = (1, 0) energy is gained"),
            Without(inelastic.name, NEWTON_LCP_BALL.with_values(E=[[2]], p=[3])),
            Without(complementary.name, NEWTON_LCP_BALL.with_values(p=[3])),
        ),
        twins=(
            Twin(
                "every such impact conserves the energy",
                equation("KE⁺ = KE", after.T * M * after, v.T * M * v),
                NEWTON_LCP_BALL,
            ),
        ),
        remarks=(
            r"$\gamma^+ + E \gamma^- \geq 0$ and $e_i \geq 0$ belong to the law but are not needed for passivity.",
            r"With one scalar $e$ the signs of $J v$ do not matter either: newton_lcp_equal.",
        ),
    )


def _skew():  # type: ignore[no-untyped-def]
    return instance(
        {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "E": [[0]], "p": [1], "v": [-1, 0]}
    )


def _mixed():  # type: ignore[no-untyped-def]
    """Return the case W = [1 −1/2; −1/2 1], p = −W⁻¹ (I + E) J v, in which both contacts push and both slacks are zero.
    """
    return instance(
        {
            "M": [["4/3", "2/3"], ["2/3", "4/3"]],
            "M⁻¹": [[1, "-1/2"], ["-1/2", 1]],
            "J": [[1, 0], [0, 1]],
            "E": [[1, 0], [0, 0]],
            "v": [-2, 1],
            "p": ["14/3", "4/3"],
        }
    )


def _pulling():  # type: ignore[no-untyped-def]
    """Return the bar: to satisfy both restitutions, its second contact must pull."""
    return instance(
        {
            "M": [[1, 0], [0, "1/12"]],
            "M⁻¹": [[1, 0], [0, 12]],
            "J": [[1, "1/2"], [1, "2/5"]],
            "E": [[1, 0], [0, 0]],
            "v": [-1, 0],
            "p": ["61/3", "-70/3"],
        }
    )


NEWTON_LCP_EQUAL_BALL = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "p": [1], "v": [-1]}, e=0)


def newton_lcp_equal() -> Statement:
    """With one restitution coefficient the Newton LCP is passive for any signs of the velocities."""
    p, after = vector("p", "c"), vector("v⁺", "d")
    name = equation("momentum balance", after, v + MI * J.T * p)
    complementary = equation("p ⟂ J v⁺ + e J v", p.T * (J * after + e * J * v), 0)
    loss = identity(
        "twice the loss, times 1 + e",
        (1 + e) * (v.T * M * v - after.T * M * after),
        (1 - e) * p.T * W * p,
        (name, name.T, *MASS_RULES),
        "complementarity gives pᵀ W p = −(1+e) pᵀ J v",
        first=(Cofactor(-2 * ONE, complementary, ONE),),
    )
    passive = positivity(
        "and it is not negative", loss.claim.rhs, (Term(1, (E_AT_MOST_ONE,), Square(MI * J.T * p, DEFINITE_MASS)),),
        MASS_RULES,
    )  # fmt: skip
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "p": [1], "v": [-1, 0]}
    return Statement(
        title="With equal restitution the Newton LCP is passive for all velocities",
        source="docs/theory.md, sharpened",
        statement=(
            r"If $v^+ = v + M^{-1} J^\top p$ and $p^\top (J v^+ + e J v) = 0$ with one scalar $e \in (-1, 1]$, then "
            r"twice the loss is $\frac{1-e}{1+e} \, p^\top W p \geq 0$: no sign of $p$ or of $J v$ is used."
        ),
        given=(*MASS, complementary, E_AT_MOST_ONE),
        definitions=(name,),
        steps=(*MASS_LEMMAS, loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=NEWTON_LCP_EQUAL_BALL,
        needed=(
            Without(SYMMETRIC_MASS.name, NEWTON_LCP_EQUAL_BALL.with_values(skew)),
            Without(INVERSE_MASS.name, NEWTON_LCP_EQUAL_BALL.with_values(M=[[2]])),
            Without(DEFINITE_MASS.name, NEWTON_LCP_EQUAL_BALL.with_values({"M": [[-1]], "M⁻¹": [[-1]], "p": [-1]})),
            Without(complementary.name, NEWTON_LCP_EQUAL_BALL.with_values(p=[3])),
            Without(E_AT_MOST_ONE.name, NEWTON_LCP_EQUAL_BALL.with_values(e=2, p=[3])),
        ),
        twins=(
            Twin(
                "the loss is pᵀ W p for every e",
                equation("KE − KE⁺", v.T * M * v - after.T * M * after, p.T * W * p),
                NEWTON_LCP_EQUAL_BALL.with_values(e="1/2", p=["3/2"]),
            ),
        ),
    )


POISSON_TWO_LCPS_BALL = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "E": [["1/2"]], "p": [1], "z": [0], "v": [-1]})
# W = [2 −2; −2 4]: the compression impulse (2, 1) stops both; with e = (1, 0) the second contact must push again
WEDGE = instance(
    {
        "M": [[1, 0], [0, 1]],
        "M⁻¹": [[1, 0], [0, 1]],
        "J": [[1, 1], [0, -2]],
        "E": [[1, 0], [0, 0]],
        "p": [2, 1],
        "z": [0, 1],
        "v": [-2, 0],
    }
)


def poisson_two_lcps() -> Statement:
    """Poisson's law by two LCPs is passive for every restitution matrix E whose I − E has no negative entry."""
    restitution, p, z = matrix("E", "c", "c"), vector("p", "c"), vector("z", "c")
    release, squeezed, after = vector("pₑ", "c"), vector("vₖ", "d"), vector("v⁺", "d")
    names = (
        equation("compression", squeezed, v + MI * J.T * p),
        equation("impulse of the restitution phase", release, restitution * p + z),
        equation("restitution", after, squeezed + MI * J.T * release),
    )
    pushes, open_ = Entrywise("compression pushes: p ≥ 0", p), Entrywise("contacts open: J v⁺ ≥ 0", J * after)
    inelastic = Entrywise("I − E ≥ 0", 1 - restitution)
    first = equation("compression ends: p ⟂ J vₖ", p.T * J * squeezed, 0)
    second = equation("pₑ − E p ⟂ J v⁺", z.T * J * after, 0)
    gap = MI * J.T * (p - release)
    rules = (*names, *(name.T for name in names), *MASS_RULES)
    loss = identity(
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        gap.T * M * gap + 2 * (J * after).T * (1 - restitution) * p,
        rules,
        "|p − pₑ|² in the metric W, and what the restitution leaves unused",
        first=(Cofactor(-4 * ONE, first, ONE), Cofactor(-2 * ONE, second, ONE)),
    )
    passive = positivity(
        "the kinetic energy does not grow",
        loss.claim.rhs,
        (Term(1, (), Square(gap, DEFINITE_MASS)), Term(2, (), Pairing(open_, pushes, inelastic))),
    )
    doubled = v + MI * J.T * (1 + restitution) * p
    return Statement(
        title="Poisson's law by two LCPs is passive",
        source="docs/theory.md (unequal restitution); Glocker and Pfeiffer",
        statement=(
            r"Compression: $v_k = v + M^{-1} J^\top p$, $0 \leq p \perp J v_k$. Restitution: $v^+ = v_k + M^{-1} "
            r"J^\top p_e$, $p_e - E p \perp J v^+ \geq 0$, with $E$ diagonal and $e_i \leq 1$. For any velocity $v$ "
            r"twice the loss is $(p - p_e)^\top W (p - p_e) + 2 (J v^+)^\top (I - E) p \geq 0$."
        ),
        given=(*MASS, pushes, open_, inelastic, first, second),
        definitions=names,
        steps=(*MASS_LEMMAS, loss, passive),
        concludes=(loss.claim.name, passive.claim.name),
        witness=WEDGE,
        needed=_needed((pushes.name, open_.name, inelastic.name, first.name, second.name)),
        twins=(
            Twin(
                "the naive impulse (I + E) p would do as well",
                NonNegative("KE − KE⁺ of the naive law", v.T * M * v - doubled.T * M * doubled),
                WEDGE,
                "the energy grows from 2 to 4",
            ),
        ),
        remarks=(r"$e_i \geq 0$, $J v_k \geq 0$ and $p_e \geq E p$ belong to the law; passivity does not need them.",),
    )


def _needed(names: tuple[str, ...]) -> tuple[Without, ...]:
    pushes, open_, inelastic, first, second = names
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "E": [[0]], "v": [-1, 0]}
    return (
        Without(SYMMETRIC_MASS.name, POISSON_TWO_LCPS_BALL.with_values(skew)),
        Without(INVERSE_MASS.name, POISSON_TWO_LCPS_BALL.with_values(M=[[2]])),
        Without(DEFINITE_MASS.name, POISSON_TWO_LCPS_BALL.with_values({"M": [[-1]], "M⁻¹": [[-1]], "v": [1]}, E=[[0]])),
        Without(pushes, POISSON_TWO_LCPS_BALL.with_values(E=[[-5]], p=[-1], v=[1]), "a compression that pulls"),
        Without(open_, POISSON_TWO_LCPS_BALL.with_values(E=[[-5]]), "a restitution that throws the body into the wall"),
        Without(inelastic, POISSON_TWO_LCPS_BALL.with_values(E=[[2]])),
        Without(first, POISSON_TWO_LCPS_BALL.with_values(p=[2], z=[0], E=[[1]])),
        Without(second, POISSON_TWO_LCPS_BALL.with_values(z=[5])),
    )


# two unit balls on a line: ball 1 hits ball 2, which rests, with velocity 1; relative row (−1, 1), elastic
BALLS = instance({"M": [[1, 0], [0, 1]], "J": [[-1, 1]], "p": [1], "v": [1, 0], "v⁺": [0, 1], "t": [1, 1]})


def momentum() -> Statement:
    """Relative rows conserve momentum; the paper's per-body rows (13)-(14) do not."""
    motion, p, after = vector("t", "d"), vector("p", "c"), vector("v⁺", "d")
    balance = equation("momentum balance (9)", M * after, M * v + J.T * p)
    rigid = equation("moving all bodies together opens no contact: J t = 0", J * motion, 0)
    kept = identity(
        "momentum along t is conserved",
        motion.T * M * after,
        motion.T * M * v,
        (rigid.T,),
        "tᵀ M v⁺ − tᵀ M v = (J t)ᵀ p",
        first=(Cofactor(motion.T, balance, ONE),),
    )
    own_rows = BALLS.with_values({"J": [[-1, 0], [0, 1]], "p": [2, 0], "v⁺": [-1, 0]})
    return Statement(
        title="Relative rows conserve momentum",
        source="paper (12) against (13)-(14); erratum 3; Newton's third law",
        statement=(
            r"Let $t$ be a motion of all bodies together (a translation or rotation), so that $J t = 0$ for relative "
            r"rows. Then $t^\top M v^+ = t^\top M v$ for every impulse $p$."
        ),
        given=(balance, rigid),
        steps=(kept,),
        concludes=(kept.claim.name,),
        witness=BALLS,
        needed=(
            Without(balance.name, BALLS.with_values({"v⁺": [0, 2]})),
            Without(rigid.name, own_rows, "(13)-(14): ball 1 bounces back from a free ball as from a wall"),
        ),
        twins=(Twin("the momentum of each body is conserved", equation("M v⁺ = M v", M * after, M * v), BALLS),),
    )


def impact_friction() -> Statement:
    """Friction in an impact is passive if it changes no normal velocity and adds at most the normal impact's loss."""
    normal, p, w, alpha = vector("n", "d"), vector("p", "c"), vector("w", "d"), scalar("α")
    rows, u = matrix("A", "c", "d"), vector("u", "d")
    impulse = equation("n = Aᵀ p", normal, rows.T * p)
    unfelt = equation("A w = 0: friction moves no normal velocity", rows * w, 0)
    loss = u.T * u - (u + normal).T * (u + normal)
    paid = NonNegative("2α uᵀw + α² |w|² ≤ what the normal impact lost",
                       loss - 2 * alpha * u.T * w - alpha * alpha * w.T * w)  # fmt: skip
    rules = (impulse, impulse.T, unfelt, unfelt.T)
    kept = identity("A (u + n + α w) = A (u + n)", rows * (u + normal + alpha * w), rows * (u + normal), rules)
    after = u + normal + alpha * w
    passive = positivity("|u + n + α w|² ≤ |u|²", u.T * u - after.T * after, (Term(1, (), paid),), rules)
    case = instance(A=[[1, 0]], p=[1], u=[-2, 3], w=[0, -2], α=1)
    return Statement(
        title="Friction in an impact is passive and keeps restitution",
        source="docs/theory.md (friction in the impact); future work of the paper",
        statement=(
            r"Let $u + n$, $n = A^\top p$, be an impact without friction in the metric of the kinetic energy, and $w$ "
            r"the effect of tangential impulses with what the rows $A$ feel of it taken out, $A w = 0$. If $\alpha$ "
            r"is so small that $2 \alpha u^\top w + \alpha^2 |w|^2$ is no more than twice the energy that $n$ lost, "
            r"then $u + n + \alpha w$ has the same normal velocities and no more energy than $u$."
        ),
        given=(unfelt, paid),
        definitions=(impulse,),
        steps=(kept, passive),
        concludes=(kept.claim.name, passive.claim.name),
        witness=case,
        needed=(
            Without(unfelt.name, case.with_values(A=[[1, 1]], u=[-2, 1])),
            Without(paid.name, case.with_values(w=[0, 2])),
        ),
        twins=(
            Twin(
                "all of Coulomb's impulse, α = 1, is always passive",
                NonNegative("½ |u + n + w|² ≤ ½ |u|²", u.T * u - (u + normal + w).T * (u + normal + w)),
                case.with_values(w=[0, -8], α="1/2"),
                "half of it reverses the slip, all of it doubles the energy: Kane and Levinson's gain",
            ),
        ),
        remarks=(
            r"The iteration that finds the tangential impulses does not enter: whatever it returns is scaled by "
            r"$\alpha$. That they lie in Coulomb's cones is not stated here; the engine's cones are tested on random "
            r"impacts.",
        ),
    )


def islands() -> Statement:
    """Islands: projectors with P₁ P₂ = 0 may be applied one after the other."""
    one, other, u = matrix("P₁", "d", "d"), matrix("P₂", "d", "d"), vector("u", "d")
    apart = equation("P₁ P₂ = 0: no coordinate is felt by rows of both islands", one * other, 0)
    together = u - (1 + e) * (one + other) * u
    first = u - (1 + e) * other * u
    result = identity("one island after the other is both at once", first - (1 + e) * one * first, together, (apart,))
    case = instance({"P₁": [[1, 0], [0, 0]], "P₂": [[0, 0], [0, 1]], "u": [2, 3]}, e="1/2")
    return Statement(
        title="An impact falls apart into its islands",
        source="docs/theory.md (islands)",
        statement=(
            r"Let $P_1$ and $P_2$ be the projectors onto the row spaces of two islands, $P_1 P_2 = 0$. Then resolving "
            r"one after the other gives $u - (1+e)(P_1 + P_2) u$, the impact of all rows."
        ),
        given=(apart,),
        steps=(result,),
        concludes=(result.claim.name,),
        witness=case,
        needed=(Without(apart.name, case.with_values({"P₁": [["1/2", "1/2"], ["1/2", "1/2"]]})),),
        twins=(
            Twin("the impact with one island left out is the same", equation("u − (1+e) P₂ u", first, together), case),
        ),
        remarks=(
            r"$M$ is block diagonal in the trees, and a row has entries for the trees of its contact only: islands "
            r"are what colliding contacts link, so that rows of two islands have $A_1 A_2^\top = 0$ and $P_1 P_2 = "
            r"0$. The projector onto all rows is then $P_1 + P_2$.",
        ),
    )
