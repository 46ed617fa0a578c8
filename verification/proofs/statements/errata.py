"""Errata of the paper, each with an exact case that demonstrates it."""

from __future__ import annotations

from fractions import Fraction

from verification.proofs.algebra import (
    Definite,
    Entrywise,
    NonNegative,
    Nonzero,
    equation,
    matrix,
    scalar,
    vector,
)
from verification.proofs.exact import instance, inverse, rank
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Dividing, Exact, Pairing, Square, Term, identity, positivity
from verification.proofs.vocabulary import E_AT_LEAST_MINUS_ONE, MI, ONE, G, J, e, v


def erratum_half() -> Statement:
    """Erratum: (32) has the factor ½ up to its last line, which drops it."""
    energy, form = scalar("k"), scalar("x")
    before = energy - (1 + e) * Fraction(1, 2) * (2 * form - (1 + e) * form)
    step = identity("the last step of (32)", before, energy - Fraction(1, 2) * (1 - e * e) * form)
    return Statement(
        title="Erratum: the factor ½ missing in (18), (24) and (32)",
        source="paper (32), last line; (18), (24); erratum 1",
        statement=(
            r"With $k = KE_0$ and $x = \dot q_0^\top J^\top \bar J^\top D \bar J J \dot q_0$ the last but one line of "
            r"(32) is $k - (1+e) \frac12 (2 x - (1+e) x)$, which equals $k - \frac12 (1-e^2) x$ and not $k - (1-e^2) "
            r"x$."
        ),
        steps=(step,),
        concludes=(step.claim.name,),
        twins=(
            Twin(
                "the last line as printed",
                equation("(32)", before, energy - (1 - e * e) * form),
                instance(k="1/2", x=1, e=0),
                "m = 1, v = −1, plastic: printed, the energy after the impact would be −1/2",
            ),
        ),
    )


def erratum_symmetric() -> Statement:
    """Erratum: after (32) the paper concludes "symmetric, hence positive semi-definite", which does not follow."""
    mass, x, form = matrix("D", "d", "d"), matrix("X", "d", "d"), matrix("S", "d", "d")
    name = equation("the matrix of the loss, with X = J̄ J", form, x.T * mass * x)
    definite = Definite("D is positive definite", mass)
    psd = positivity("S ⪰ 0", form, (Term(1, (), Square(x, definite)),), (name,), "a congruence of D")
    case = instance({"D": [[1]], "X": [[1]], "Y": [[-1]]})
    other = matrix("Y", "d", "d")
    return Statement(
        title="Erratum: symmetric does not mean positive semi-definite",
        source="paper, Appendix I, the sentence after (32)",
        statement=(
            r"$S = (\bar J J)^\top D (\bar J J)$ is positive semi-definite because it is a congruence of $D \succ 0$; "
            r"the paper's reason, that it is symmetric, does not carry."
        ),
        given=(definite,),
        definitions=(name,),
        steps=(psd,),
        concludes=("S ⪰ 0",),
        witness=case,
        needed=(Without(definite.name, case.with_values(D=[[-1]])),),
        twins=(
            Twin(
                "the paper's reason: every symmetric matrix is positive semi-definite",
                NonNegative("Y + Yᵀ ⪰ 0", other + other.T),
                case,
            ),
        ),
    )


def erratum_hypothesis() -> Statement:
    """Erratum: the hypothesis of Theorem 2 is printed with q̇ instead of q̇₀."""
    after = vector("v⁺", "d")
    printed = equation("as printed: J q̇ = −e J q̇", J * after, -e * J * after)
    distinct = Nonzero("e is not −1", 1 + e)
    product = identity("(1 + e) J q̇ = 0", (1 + e) * J * after, 0, first=(Cofactor(ONE, printed, ONE),))
    stuck = Dividing(equation("every impact is plastic: J q̇ = 0", J * after, 0), product.claim, distinct)
    case = instance({"J": [[1]], "v⁺": [0], "v": [-1]}, e=1)
    return Statement(
        title="Erratum: the restitution law printed in Theorem 2",
        source="paper V-B, hypothesis of Theorem 2",
        statement=(
            r"Theorem 2 asks for $J_c \dot q = -e J_c \dot q$, with the same velocity on both sides. For $e \neq -1$ "
            r"that says $J_c \dot q = 0$: every impact would be plastic. Meant is (15), $J_c \dot q = -e J_c \dot "
            r"q_0$."
        ),
        given=(printed, distinct),
        steps=(product, stuck),
        concludes=(stuck.claim.name,),
        witness=case,
        needed=(
            Without(printed.name, case.with_values({"v⁺": [1]})),
            Without(distinct.name, case.with_values({"v⁺": [1]}, e=-1)),
        ),
        twins=(
            Twin(
                "the printed hypothesis is Newton's law (15)",
                equation("J q̇ = −e J q̇₀", J * after, -e * J * v),
                case,
                "an elastic ball that is stopped dead",
            ),
        ),
    )


def erratum_rank() -> Statement:
    """Erratum: Appendix III states that the remaining rows have full rank, which is false."""
    rows = [[1], [1], [1]]
    all_rows, left_over = Fraction(rank(rows)), Fraction(rank(rows[1:]))
    return Statement(
        title="Erratum: the rank of the rows left over",
        source="paper, Appendix III, before (36)",
        statement=(
            r"The paper splits $J_c$ into $J_n$ of rank $n$ and $J_r$ of $r$ rows and says $rank(J_r) = r$. One wall "
            r"reported three times has $n = 1$, $r = 2$ and $rank(J_r) = 1$. Nothing in the proof uses the claim."
        ),
        steps=(
            Exact("the rank of all three rows, so n = 1", all_rows, "=", Fraction(1)),
            Exact("the rank of the two rows left over", left_over, "=", Fraction(1)),
        ),
        twins=(Twin("as printed", Exact("rank(J_r) = r", left_over, "=", Fraction(2))),),
    )


def erratum_shape() -> Statement:
    """Erratum: the paper gives J_i the size d x 3, but (1) multiplies a force by its transpose."""
    jacobian, force = matrix("Jᵢ", "k", "d"), vector("F", "k")
    work = identity("power at the contact = power in the joints", force.T * (jacobian * v), (jacobian.T * force).T * v)
    square = matrix("Jᵢ", "d", "d")
    case = instance({"Jᵢ": [[0, 1, 0], [0, 0, 0], [0, 0, 0]], "F": [1, 0, 0], "v": [0, 1, 0]})
    return Statement(
        title="Erratum: the manipulator Jacobian is 3 x d, not d x 3",
        source="paper, below (1); the same for J_h (6 x d)",
        statement=(
            r"$J_i^\top F_i$ in (1) has $d$ components, and $J_i \dot q$ is a velocity in space, only if $J_i$ is $3 "
            r"\times d$. Then the powers agree, $F_i^\top (J_i \dot q) = (J_i^\top F_i)^\top \dot q$."
        ),
        steps=(work,),
        concludes=(work.claim.name,),
        twins=(
            Twin(
                "the printed shape for d = 3, the only case in which it is defined: the force map would be the "
                "transpose",
                equation("Fᵀ J v = (J F)ᵀ v", vector("F", "d").T * square * v, (square * vector("F", "d")).T * v),
                case,
                "for d other than 3 the product does not even exist",
            ),
        ),
    )


def erratum_friction_sign() -> Statement:
    """Erratum: the sliding branch of (6) has no sign; with a signed v_t it can accelerate the motion."""
    mu, normal, sign, speed, friction = (scalar(name) for name in ("μ", "N", "σ", "vₜ", "f"))
    law = equation("friction with its sign", friction, -mu * normal * sign)
    rough, pressed = NonNegative("μ ≥ 0", mu), NonNegative("N ≥ 0", normal)
    along = NonNegative("σ = ±1 is the sign of vₜ: σ vₜ ≥ 0", sign * speed)
    passive = positivity(
        "friction takes energy: −f vₜ ≥ 0", -friction * speed, (Term(1, (rough, pressed, along)),), (law,)
    )
    case = instance({"μ": "1/2", "N": 1, "σ": -1, "vₜ": -1})
    return Statement(
        title="Erratum: the sign missing in the friction law",
        source="paper (6); the absolute value in its condition shows that vₜ may be negative",
        statement=(
            r"(6) sets $F_f = -\mu F_n$ for $|v_t| \geq v_{threshold}$. For $v_t < 0$ this pushes along the motion. "
            r"With $\sigma$ the sign of $v_t$, $f = -\mu N \sigma$ takes the power $\mu N |v_t| \geq 0$ out."
        ),
        given=(rough, pressed, along),
        definitions=(law,),
        steps=(passive,),
        concludes=(passive.claim.name,),
        witness=case,
        needed=(
            Without(rough.name, case.with_values(μ=-1)),
            Without(pressed.name, case.with_values(N=-1), "(5) as printed may pull; friction then drives the motion"),
            Without(along.name, case.with_values(σ=1), "the printed law"),
        ),
        twins=(
            Twin(
                "(6) as printed takes energy at every velocity",
                NonNegative("μ N vₜ ≥ 0", mu * normal * speed),
                case,
                "a body sliding at −1 is pushed by −1/2",
            ),
        ),
        remarks=(
            "If t is turned to point along the sliding velocity in each step, vₜ is never negative and (6) is right; "
            "the paper only says that t is orthogonal to the normal.",
        ),
    )


BALLS = instance({"M⁻¹": [[1, 0], [0, 1]], "J": [[-1, 1]], "G": [["1/2"]], "v": [1, 0], "t": [1, 1]}, e=1)


def erratum_self_collision() -> Statement:
    """Erratum: per-body rows (13)-(14) make the outcome depend on the observer."""
    shift, after, moved = vector("t", "d"), vector("v⁺", "d"), vector("w⁺", "d")
    names = (
        equation("the impact", after, v - (1 + e) * MI * J.T * G * J * v),
        equation("the impact seen from a moving frame", moved, (v + shift) - (1 + e) * MI * J.T * G * J * (v + shift)),
    )
    rigid = equation("moving all bodies together opens no contact: J t = 0", J * shift, 0)
    same = identity("both observers agree: w⁺ = v⁺ + t", moved, after + shift, (*names, rigid))
    own_rows = BALLS.with_values({"J": [[-1, 0], [0, 1]], "G": [[1, 0], [0, 1]]})
    return Statement(
        title="Erratum: per-body rows depend on the observer",
        source="paper (13)-(14), assumption (ii); erratum 3",
        statement=(
            r"With relative rows (12) a common velocity $t$ of all bodies has $J t = 0$, and adding it before the "
            r"impact adds it after. With the per-body rows (13)-(14) it does not."
        ),
        given=(rigid,),
        definitions=names,
        steps=(same,),
        concludes=(same.claim.name,),
        witness=BALLS,
        needed=(
            Without(
                rigid.name,
                own_rows,
                "a ball that hits an equal one at rest bounces back at −1 and leaves it at rest; seen from a frame "
                "that moves along, both bounce at −2 and −1",
            ),
        ),
        twins=(Twin("a common velocity changes nothing", equation("w⁺ = v⁺", moved, after), BALLS),),
        remarks=(
            "The reason given for (13)-(14), passivity, does not ask for them: theorem_2 holds for every J. That they "
            "also break conservation of momentum is in the file momentum.",
        ),
    )


# a point mass in a wedge: normals (1, 0) and (4/5, 3/5) at an acute angle; W⁻¹ has negative entries
WEDGE_DELASSUS = [[1, "4/5"], ["4/5", 1]]
BALL = instance({"J": [[1]], "W⁻¹": [[1]], "v": [-1], "y": [1]}, e=0)


def erratum_adhesion() -> Statement:
    """Erratum: assumption (i), impulses at all approaching contacts, can make impulses pull.

    The statement gives a condition under which no impulse pulls, and a case in which one does.
    """
    wi, y, p = matrix("W⁻¹", "c", "c"), vector("y", "c"), vector("p", "c")
    name = equation("the impulse (19)", p, -(1 + e) * wi * J * v)
    approaching = Entrywise("every contact approaches: −J v ≥ 0", -J * v)
    coupling = Entrywise("W⁻¹ has no negative entry", wi)
    probe = Entrywise("y ≥ 0, any such vector", y)
    pushes = positivity(
        "no impulse pulls: yᵀ p ≥ 0",
        y.T * p,
        (Term(1, (E_AT_LEAST_MINUS_ONE,), Pairing(probe, approaching, coupling)),),
        (name,),
    )
    wedge = instance(
        {"J": [[1, 0], ["4/5", "3/5"]], "W⁻¹": inverse(WEDGE_DELASSUS), "v": [-1, "1/2"], "y": [0, 1]}, e=0
    )
    return Statement(
        title="Erratum: impulses at all approaching contacts can pull",
        source="paper V, assumption (i); erratum 4",
        statement=(
            r"If $W^{-1}$ has no negative entry (contacts that do not push each other apart), then $-J v \geq 0$ "
            r"gives $p = -(1+e) W^{-1} J v \geq 0$. In general some $p_i$ is negative: an adhesive contact."
        ),
        given=(approaching, coupling, probe, E_AT_LEAST_MINUS_ONE),
        definitions=(name,),
        steps=(pushes,),
        concludes=(pushes.claim.name,),
        witness=BALL,
        needed=(
            Without(approaching.name, BALL.with_values(v=[1])),
            Without(coupling.name, wedge, "a point mass in an acute wedge: the second wall pulls with 5/6"),
            Without(probe.name, BALL.with_values(y=[-1])),
            Without(E_AT_LEAST_MINUS_ONE.name, BALL.with_values(e=-2)),
        ),
        twins=(
            Twin(
                "a contact that did not approach does not approach afterwards: here the opposite wall of a tight slot, "
                "row −J",
                NonNegative("−J v⁺ ≥ 0 for a unit mass, v⁺ = v + Jᵀ p", _slot()),
                BALL.with_values(e=1),
                "the rebound from one wall approaches the other wall",
            ),
        ),
    )


def _slot():  # type: ignore[no-untyped-def]
    """Return yᵀ (−J)(v + Jᵀ p), the velocity at the opposite wall after the impact."""
    return -vector("y", "c").T * J * (v + J.T * vector("p", "c"))


MASS, SPEED, RESTITUTION, FORCE, STEP = (Fraction(2), Fraction(-1, 10), Fraction(1, 2), Fraction(15), Fraction(1, 512))


def spread(speed: Fraction) -> tuple[Fraction, int]:
    """Return the final velocity of a spread impulse and the number of steps; each step applies Newton's law anew."""
    steps = 0
    while speed < 0:
        wanted = -(1 + RESTITUTION) * MASS * speed
        impulse = min(wanted, FORCE * STEP)
        speed, steps = speed + impulse / MASS, steps + 1
        if impulse == wanted:
            break
    return speed, steps


def erratum_spreading() -> Statement:
    """Erratum: spreading an impulse over steps does not end at the prescribed velocity, unless e = 0."""
    start, factor, middle, end = (scalar(name) for name in ("v₀", "s", "v₁", "v₂"))
    names = (
        equation("first step, scaled by s", middle, (1 - factor * (1 + e)) * start),
        equation("last step, in full", end, -e * middle),
    )
    miss = identity("what is missing", end + e * start, e * (1 + e) * factor * start, names, "v₂ − (−e v₀)")
    speed, steps = spread(SPEED)
    return Statement(
        title="Erratum: spreading does not deliver the prescribed restitution",
        source="paper VI, third strategy; erratum 5",
        statement=(
            r"Scale the first impulse by $s$, then apply Newton's law again in full: the velocity ends at $-e v_0 + e "
            r"(1+e) s v_0$. The prescribed $-e v_0$ is reached only for $e = 0$ (or $s = 0$, $e = -1$)."
        ),
        definitions=names,
        steps=(
            miss,
            Exact("steps taken: m = 2 kg, v = −0.1 m/s, e = 1/2, 15 N, 512 Hz", Fraction(steps), "=", Fraction(7)),
            Exact("velocity reached [m/s], instead of 0.05", speed, "<", Fraction(26, 10000)),
        ),
        concludes=(miss.claim.name,),
        twins=(
            Twin(
                "as the paper says: the prescribed velocity is reached",
                equation("v₂ = −e v₀", end, -e * start),
                instance({"v₀": -1, "s": "1/2"}, e="1/2"),
            ),
            Twin("the numbers above", Exact("velocity reached", speed, "=", Fraction(1, 20))),
        ),
        remarks=("The remedy is to remember the target: apply what is missing to −e v₀ in each step.",),
    )


LIMIT_FORCE, LIMIT_TORQUE = Fraction(15, 512), Fraction(1, 512)  # 15 N and 1 N m over one step of 1/512 s


def erratum_saturation() -> Statement:
    """Erratum: clipping the device's force component by component can add energy to the device."""
    f, speed, inverse_mass, factor, gain = (scalar(name) for name in ("f", "v", "ω", "s", "Δ"))
    name = equation(
        "twice the energy gain of one component of a diagonal inertia", gain, _gain(factor, f, speed, inverse_mass)
    )
    low, high = NonNegative("s ≥ 0", factor), NonNegative("s ≤ 1", 1 - factor)
    mass = NonNegative("ω = 1/m ≥ 0", inverse_mass)
    alone = NonNegative("unclipped, this component loses by itself", -_gain(1, f, speed, inverse_mass))
    passive = positivity(
        "clipped, it loses too",
        -gain,
        (Term(1, (low, alone)), Term(1, (low, high, mass, NonNegative("f² ≥ 0", f * f)))),
        (name,),
    )
    square = positivity("f² ≥ 0", f * f, (_square(f),))
    case = instance(f=1, v=-1, ω=1, s="1/2")
    return Statement(
        title="Erratum: saturating component by component can add energy",
        source="paper VI, first strategy; erratum 5",
        statement=(
            r"For a diagonal inertia, clipping component $i$ of the impulse is harmless when that component loses "
            r"energy by itself. An impact only promises that the sum loses: with one component clipped the other may "
            r"win."
        ),
        given=(low, high, mass, alone),
        definitions=(name,),
        steps=(square, passive, *_peg()[0]),
        concludes=(passive.claim.name,),
        witness=case,
        needed=(
            Without(low.name, case.with_values(s=-1)),
            Without(high.name, case.with_values(s=3)),
            Without(mass.name, case.with_values(f=1, v=-1, ω=-4, s="1/2").with_values(v=1, ω=-2, s="1/2")),
            Without(alone.name, case.with_values(v=1)),
        ),
        twins=(Twin("saturation is passive: the peg struck at its corner", _peg()[1]),),
        remarks=(
            "The peg (2 kg, 0.005 kg m²) meets a wall with the arm 0.01 m, moving at −0.1 m/s and turning away at 4 "
            "rad/s, e = 0. The limits are the paper's, 15 N and 1 N m for one step at 512 Hz.",
        ),
    )


def _gain(factor, f, speed, inverse_mass):  # type: ignore[no-untyped-def]
    return 2 * factor * f * speed + factor * factor * f * f * inverse_mass


def _square(f):  # type: ignore[no-untyped-def]
    return Term(1, (), Square(f))


def _peg() -> tuple[tuple[Exact, ...], Exact]:
    """Return the energies of the peg for the full impulse and for the impulse as clipped by the device."""
    mass, inertia, arm = Fraction(2), Fraction(1, 200), Fraction(1, 100)
    speed, spin = Fraction(-1, 10), Fraction(4)
    p = -(speed + arm * spin) / (1 / mass + arm**2 / inertia)
    force, torque = min(p, LIMIT_FORCE), min(arm * p, LIMIT_TORQUE)

    def gained(force: Fraction, torque: Fraction) -> Fraction:
        return force * speed + force**2 / (2 * mass) + torque * spin + torque**2 / (2 * inertia)

    zero = Fraction(0)
    steps = (
        Exact("the full impulse takes energy [J]", gained(p, arm * p), "<", zero),
        Exact("the force is clipped [N s]", p, ">", LIMIT_FORCE),
        Exact("the torque is not [N m s]", arm * p, "<", LIMIT_TORQUE),
        Exact("the clipped one adds energy [J]", gained(force, torque), ">", zero),
    )
    return steps, Exact("energy added by the clipped impulse [J]", gained(force, torque), "≤", zero)
