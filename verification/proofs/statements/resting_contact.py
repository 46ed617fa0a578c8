"""Implicit resting contact never creates energy: the force of one contact, then all contacts with the bodies."""

from __future__ import annotations

from fractions import Fraction

from verification.proofs.algebra import Entrywise, NonNegative, equation, matrix, scalar, vector
from verification.proofs.exact import instance
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Dominating, Exact, Pairing, Square, Term, identity, positivity
from verification.proofs.vocabulary import DEFINITE_MASS, ONE, SYMMETRIC_MASS, J, M

STIFFNESS, STEP, GAP, MASS = Fraction(8), Fraction(1), Fraction(-1), Fraction(1)  # at rest, undamped


def energy_after(*, implicit: bool) -> Fraction:
    """Return KE⁺ + Φ⁺ of one mass on its spring, with the force of the step's end (implicit) or of its start."""
    speed = -STEP * STIFFNESS * GAP / (MASS + STEP**2 * STIFFNESS * implicit)
    return MASS * speed**2 / 2 + STIFFNESS * min(GAP + STEP * speed, Fraction(0)) ** 2 / 2


BEFORE = STIFFNESS * GAP**2 / 2
IMPLICIT = Exact("KE⁺ + Φ⁺ of one mass, implicit force [J]", energy_after(implicit=True), "≤", BEFORE)
EXPLICIT = Twin(
    "the same with the explicit force, max(0, −K φ − B γ*)",
    Exact("KE⁺ + Φ⁺ of one mass, explicit force [J]", energy_after(implicit=False), "≤", BEFORE),
    note="M = 1 kg at rest, K = 8 N/m, B = 0, φ = −1 m, h = 1 s: it leaves at 8 m/s, with 32 J instead of 4 J",
)
HELD = instance({"K": 1, "B": 1, "h": 1, "φ": -1, "γ": 0, "φ⁺": -1, "n": 1, "n⁺": 1, "f": 1})


def resting_contact() -> Statement:
    """One contact: its implicit force does at most the work that its spring gives, for every K, B and h >= 0."""
    stiff, damp, h, gap, speed, gap_after = (scalar(name) for name in ("K", "B", "h", "φ", "γ", "φ⁺"))
    n, n_after, f, k = (scalar(name) for name in ("n", "n⁺", "f", "k"))
    name = equation("stiffness over a step: k = K h + B", k, stiff * h + damp)
    linear = equation("the gap is linear over the step: h γ = φ⁺ − φ", h * speed, gap_after - gap)
    k_sign, b_sign, h_sign = (NonNegative(f"{letter} ≥ 0", scalar(letter)) for letter in ("K", "B", "h"))
    f_sign, f_least = NonNegative("f ≥ 0", f), NonNegative("f ≥ −K φ − k γ", f + stiff * gap + k * speed)
    f_exact = equation("f is 0 or −K φ − k γ", f * f_least.value, 0)
    n_least, after_sign = NonNegative("n ≥ −φ", n + gap), NonNegative("n⁺ ≥ 0", n_after)
    after_least = NonNegative("n⁺ ≥ −φ⁺", n_after + gap_after)
    after_exact = equation("n⁺ is 0 or −φ⁺", n_after * after_least.value, 0)
    x, square = speed * (stiff * n_after - f), Square(speed)
    factor = positivity("γ² B ≥ 0", speed * speed * damp, (Term(1, (b_sign,), square),))
    product = positivity(
        "γ² B x ≥ x² for x = γ (K n⁺ − f)",
        factor.claim.value * x - x * x,
        (Term(1, (k_sign, after_sign, f_least), square), Term(1, (k_sign, after_least, f_sign), square)),
        (name, linear),
        "f and K n⁺ are the positive parts of two numbers that differ by B γ",
        tuple(Cofactor(-speed * speed * y, fact, ONE) for y, fact in ((ONE, f_exact), (stiff * stiff, after_exact))),
    )
    damper = Dominating(NonNegative("the damper takes energy: γ (K n⁺ − f) ≥ 0", x), factor.claim, product.claim)
    taken = stiff * (n * n - n_after * n_after) - 2 * h * f * speed
    passive = positivity(
        "twice the energy that the contact takes",
        taken,
        (Term(1, (k_sign,), Square(n - n_after)), Term(2, (k_sign, after_sign, n_least)),
         Term(2, (h_sign, damper.claim))),
        (linear,),
        "the energy of the spring is convex: K n² − K (n⁺)² ≥ 2 K n⁺ (n − n⁺)",
        (Cofactor(-2 * stiff, after_exact, ONE),),
    )  # fmt: skip
    free, sinking = {"γ": 1, "φ⁺": 0, "n⁺": 0}, {"φ": -3, "γ": 1, "φ⁺": -2, "n": 3}
    return Statement(
        title="Implicit resting contact: a contact never gives energy",
        source="docs/theory.md (implicit resting contact)",
        statement=(
            r"Let $K, B, h \geq 0$, $k = K h + B$, $f = \max(0, -K \varphi - k \gamma)$, $\varphi^+ = \varphi + h "
            r"\gamma$, $n = \max(0, -\varphi)$ and $n^+ = \max(0, -\varphi^+)$. Then $h f \gamma + \frac12 K (n^+)^2 "
            r"\leq \frac12 K n^2$, and $f - K n^+$, the part of the damper, gives nothing: $(f - K n^+) \gamma \leq 0$."
        ),
        given=(k_sign, b_sign, h_sign, f_sign, f_least, f_exact, n_least, after_sign, after_least, after_exact, linear),
        definitions=(name,),
        steps=(factor, product, damper, passive, IMPLICIT),
        concludes=(damper.claim.name, passive.claim.name),
        witness=HELD,
        needed=(
            Without(k_sign.name, HELD.with_values(free, K=-1, f=0)),
            Without(b_sign.name, HELD.with_values(free, B=-1), "a damper that drives"),
            Without(h_sign.name, HELD.with_values(free, h=-1, γ=-1)),
            Without(f_sign.name, HELD.with_values(free, B=0, φ=2, γ=-1, n=0, f=-1).with_values({"φ⁺": 1}), "adhesion"),
            Without(f_least.name, HELD.with_values(φ=0, γ=-1, n=0, f=0), "a contact that gives way"),
            Without(f_exact.name, HELD.with_values(free), "it pushes with 1 instead of 0"),
            Without(n_least.name, HELD.with_values(n=0)),
            Without(after_sign.name, HELD.with_values({"φ⁺": 1, "n⁺": -1}, φ=1, n=0, f=0)),
            Without(after_least.name, HELD.with_values({**sinking, "n⁺": 0}), "the spring forgets that it is pressed"),
            Without(after_exact.name, HELD.with_values({"n⁺": 2})),
            Without(linear.name, HELD.with_values({"φ⁺": -2, "n⁺": 2}), "a gap that closes without a velocity"),
        ),
        twins=(EXPLICIT, Twin("with equality", equation("nothing is taken", taken, 0), HELD.with_values(
            {**sinking, "n⁺": 2}))),
        remarks=(
            r"$f = \max(0, -K \varphi - k \gamma)$ is three facts: $f$ is at least each of the two, and equal to one. "
            r"So is $n^+$; of $n$ only $n \geq -\varphi$ is used.",
        ),
    )  # fmt: skip


PUSHED = instance({"M": [[1]], "J": [[1]], "T": [[0]], "P": [["8/9"]], "u": [1], "r": [0], "v*": [0], "v⁺": ["8/9"]},
                  a=[4], b=["4/81"])  # fmt: skip
RUBBED = PUSHED.with_values({"J": [[0]], "T": [[1]], "r": [-1], "v*": [1], "v⁺": [0]}, a=[0], b=[0])


def resting_energy() -> Statement:
    """All contacts of a step, with the bodies and any friction: KE⁺ + Φ⁺ <= KE* + Φ + the work of friction."""
    p, u, a, b = (vector(name, "c") for name in ("p", "u", "a", "b"))
    free, after, r = vector("v*", "d"), vector("v⁺", "d"), vector("r", "t")
    pushes, tangents, change = matrix("P", "c", "c"), matrix("T", "t", "d"), after - free
    name = equation("normal impulses: p = P u", p, pushes.T * u)
    balance = equation("momentum balance of the step", M * after, M * free + J.T * p + tangents.T * r)
    ones, rubs = Entrywise("u ≥ 0", u), NonNegative("friction takes energy", -(r.T * tangents * after))
    contacts = Entrywise("each contact takes energy: resting_contact", a - b - pushes * J * after)
    gained, rubbing = after.T * M * after - free.T * M * free, 2 * r.T * tangents * after
    gain = identity("twice the gain of kinetic energy", gained, 2 * p.T * J * after + rubbing - change.T * M * change,
                    (SYMMETRIC_MASS,), "v⁺ times the balance", (Cofactor(2 * after.T, balance, ONE),))  # fmt: skip
    with_friction = positivity(
        "KE⁺ + Φ⁺ ≤ KE* + Φ + rᵀ T v⁺, twice",
        2 * u.T * (a - b) + rubbing - gained,
        (Term(1, (), Square(change, DEFINITE_MASS)), Term(2, (), Pairing(ones, contacts))),
        (name.T,),
        "the contacts, summed",
        (Cofactor(-ONE, gain.claim, ONE),),
    )
    passive = positivity("KE⁺ + Φ⁺ ≤ KE* + Φ, twice", 2 * u.T * (a - b) - gained,
                         (Term(1, (), with_friction.claim), Term(2, (), rubs)))  # fmt: skip
    skew = {"M": [[1, 1], [0, 1]], "J": [[0, 0]], "T": [[1, 0]], "v*": [2, 1], "v⁺": [1, 1], "r": [-1]}
    wrong = 2 * p.T * J * free + 2 * r.T * tangents * free - change.T * M * change
    return Statement(
        title="Implicit resting contact never creates energy, for every stiffness, damping, step and mass",
        source="docs/theory.md (implicit resting contact)",
        statement=(
            r"Let $M (v^+ - v^*) = J^\top p + T^\top r$, where contact $i$ has $p_i = h f_i$ with the force $f_i$ of "
            r"resting_contact at $\gamma = J v^+$, $a_i = \frac12 K_i n_i^2$ and $b_i = \frac12 K_i (n_i^+)^2$. With "
            r"$\Phi = \sum a_i$ and $\Phi^+ = \sum b_i$, $KE^+ + \Phi^+ \leq KE^* + \Phi + r^\top T v^+$ for any "
            r"tangential impulses $r$, so $KE^+ + \Phi^+ \leq KE^* + \Phi$ if $r^\top T v^+ \leq 0$."
        ),
        given=(SYMMETRIC_MASS, DEFINITE_MASS, balance, ones, contacts, rubs),
        definitions=(name,),
        steps=(gain, with_friction, passive),
        concludes=(gain.claim.name, with_friction.claim.name, passive.claim.name),
        witness=PUSHED,
        needed=(
            Without(SYMMETRIC_MASS.name, RUBBED.with_values(skew), "a mass matrix with a skew part"),
            Without(DEFINITE_MASS.name, RUBBED.with_values(M=[[-1]], r=[1])),
            Without(balance.name, PUSHED.with_values({"v⁺": [2]}, b=[0]), "the impulse is too small for this speed"),
            Without(ones.name, RUBBED.with_values(u=[-1], a=[1])),
            Without(contacts.name, PUSHED.with_values({"P": [[8]], "v⁺": [8]}, b=[0]), "the explicit force"),
            Without(rubs.name, RUBBED.with_values({"v⁺": [2]}, r=[1]), "friction that drives"),
        ),
        twins=(EXPLICIT, Twin("the work at v* in place of v⁺", equation("gain, at v*", gained, wrong), PUSHED)),
        remarks=(
            r"$u$ holds ones and $P$ is the diagonal matrix of the impulses, so that the contacts can be summed.",
            r"With $J v^*$ the last term of the gain would be positive: an explicit force can create that much.",
        ),
    )  # fmt: skip
