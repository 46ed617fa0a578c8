"""Consequences of the theorems: one contact, other coordinates, scaled impulses, independence of stiffness."""

from __future__ import annotations

from verification.proofs.algebra import NonNegative, equation, matrix, scalar, vector
from verification.proofs.exact import impact_case, instance
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cancelling, Cofactor, Positivity, Square, Term, identity, positivity
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_LEAST_MINUS_ONE,
    E_AT_MOST_ONE,
    GENERALIZED_INVERSE,
    INVERSE_MASS,
    MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ON_ROW_SPACE,
    ONE,
    ROW_SPACE_LEMMAS,
    SYMMETRIC_MASS,
    G,
    J,
    M,
    W,
    e,
    v,
)

SINGLE_CONTACT_COMPLEMENTARITY_CASE = instance({"γ⁻": -1, "p": 1, "w": 1, "ω": 1}, e=0)


def single_contact_complementarity() -> Statement:
    """C05: for one approaching contact the paper's impulse is the unique solution of the complementarity problem."""
    gamma, p, w, omega, slack = (scalar(name) for name in ("γ⁻", "p", "w", "ω", "s"))
    name = equation("slack: γ⁺ + e γ⁻ with γ⁺ = γ⁻ + w p", slack, (1 + e) * gamma + w * p)
    approaching = NonNegative("the contact approaches: γ⁻ ≤ 0", -gamma)
    separated = NonNegative("γ⁺ + e γ⁻ ≥ 0", slack)
    complementary = equation("p (γ⁺ + e γ⁻) = 0", p * slack, 0)
    inverse = equation("ω = 1/w", omega * w, 1)
    positive = NonNegative("w > 0", omega)
    square = Positivity(
        NonNegative("−s² ≥ 0", -(slack * slack)),
        (Term(1, (E_AT_LEAST_MINUS_ONE, approaching, separated)),),
        (Cofactor(-slack, name, ONE), Cofactor(-w, complementary, ONE)),
        "s² = s ((1+e) γ⁻ + w p), and s p = 0",
    )
    tight = Cancelling(equation("Newton's law holds: s = 0", slack, 0), square.claim, None, "a square ≤ 0 is 0")
    unique = identity(
        "the impulse is the paper's (19)",
        p,
        -(1 + e) * omega * gamma,
        because="ω w p = ω (s − (1+e) γ⁻)",
        first=(Cofactor(-p, inverse, ONE), Cofactor(omega, tight.claim, ONE), Cofactor(-omega, name, ONE)),
    )
    pushes = positivity(
        "and it pushes", -(1 + e) * omega * gamma, (Term(1, (E_AT_LEAST_MINUS_ONE, approaching, positive)),)
    )
    return Statement(
        title="One contact: the impulse of the complementarity problem",
        source="paper V-A; C05",
        statement=(
            r"Let $w = J M^{-1} J^\top > 0$ and $\gamma^- \leq 0$, $e \geq -1$. Whatever $p$ solves $\gamma^+ + e "
            r"\gamma^- \geq 0$, $p \, (\gamma^+ + e \gamma^-) = 0$ with $\gamma^+ = \gamma^- + w p$ is $p = -(1+e) "
            r"\gamma^- / w$, and it is not negative."
        ),
        given=(approaching, separated, complementary, inverse, positive, E_AT_LEAST_MINUS_ONE),
        definitions=(name,),
        steps=(square, tight, unique, pushes),
        concludes=(tight.claim.name, unique.claim.name, pushes.claim.name),
        witness=SINGLE_CONTACT_COMPLEMENTARITY_CASE,
        needed=(
            Without(
                approaching.name,
                SINGLE_CONTACT_COMPLEMENTARITY_CASE.with_values({"γ⁻": 1, "p": 0}),
                "a separating contact needs no impulse",
            ),
            Without(separated.name, SINGLE_CONTACT_COMPLEMENTARITY_CASE.with_values(p=0)),
            Without(complementary.name, SINGLE_CONTACT_COMPLEMENTARITY_CASE.with_values(p=2)),
            Without(inverse.name, SINGLE_CONTACT_COMPLEMENTARITY_CASE.with_values(ω=2)),
            Without(positive.name, SINGLE_CONTACT_COMPLEMENTARITY_CASE.with_values(w=-1, ω=-1, p=-1)),
            Without(E_AT_LEAST_MINUS_ONE.name, SINGLE_CONTACT_COMPLEMENTARITY_CASE.with_values(e=-2, p=0)),
        ),
        twins=(
            Twin(
                "an impulse without the 1 + e",
                equation("p = −e γ⁻/w", p, -e * omega * gamma),
                SINGLE_CONTACT_COMPLEMENTARITY_CASE,
            ),
        ),
        remarks=(r"$p \geq 0$ is not assumed; it follows.",),
    )


COORDINATE_INVARIANCE_CASE = instance(
    {
        "F": [[1, 0], [0, 2]],
        "F⁻¹": [[1, 0], [0, "1/2"]],
        "M": [[1, 0], [0, 1]],
        "M⁻¹": [[1, 0], [0, 1]],
        "J": [[1, 1]],
        "G": [["1/2"]],
        "w": [1, 0],
        "J⁺": [["1/2"], ["1/2"]],
        "Jᵣ⁺": [["1/5"], ["2/5"]],
    },
    e=0,
)


def coordinate_invariance() -> Statement:
    """C06: the impact does not depend on the choice of coordinates q = f(r)."""
    f, fi, w = matrix("F", "d", "r"), matrix("F⁻¹", "r", "d"), vector("w", "r")
    mr, mri, jr = matrix("Mᵣ", "r", "r"), matrix("Mᵣ⁻¹", "r", "r"), matrix("Jᵣ", "c", "r")
    names = (
        equation("velocity: q̇ = F ṙ, with w = ṙ", v, f * w),
        equation("mass matrix in the new coordinates", mr, f.T * M * f),
        equation("its inverse", mri, fi * MI * fi.T),
        equation("contact Jacobian in the new coordinates", jr, J * f),
    )
    left, right = equation("F⁻¹ F = I", fi * f, 1), equation("F F⁻¹ = I", f * fi, 1)
    rules = (*names, *(name.T for name in names), left, right, left.T, right.T, INVERSE_MASS)
    inverse = identity("Mᵣ Mᵣ⁻¹ = I", mr * mri, 1, rules)
    delassus = identity("the Delassus matrix is the same", jr * mri * jr.T, W, rules)
    velocity = identity(
        "the velocity after the impact is the same",
        f * (w - (1 + e) * mri * jr.T * G * jr * w),
        v - (1 + e) * MI * J.T * G * J * v,
        rules,
    )
    energy = identity("the kinetic energy is the same", w.T * mr * w, v.T * M * v, rules)
    euclid, euclid_r = matrix("J⁺", "d", "c"), matrix("Jᵣ⁺", "r", "c")
    steps = (inverse, delassus, velocity, energy)
    return Statement(
        title="The impact does not depend on coordinates",
        source="paper V-A; C06",
        statement=(
            r"Let $q = f(r)$ with invertible $F = \partial f / \partial r$, so $v = F w$, $M_r = F^\top M F$, $J_r = "
            r"J F$. The Delassus matrix, hence $G$ and the impulses, are the same, and $F w^+ = v^+$."
        ),
        given=(left, right, INVERSE_MASS),
        definitions=names,
        steps=steps,
        concludes=tuple(step.claim.name for step in steps),
        witness=COORDINATE_INVARIANCE_CASE,
        needed=(
            Without(
                (left.name, right.name),
                COORDINATE_INVARIANCE_CASE.with_values(**{"F⁻¹": [[1, 0], [0, 1]]}),
                "both sides of an inverse",
            ),
            Without(INVERSE_MASS.name, COORDINATE_INVARIANCE_CASE.with_values(M=[[2, 0], [0, 1]])),
        ),
        twins=(
            Twin(
                "the plain pseudo-inverse J⁺ would be invariant too",
                equation("the same velocity", f * (w - (1 + e) * euclid_r * jr * w), v - (1 + e) * euclid * J * v),
                COORDINATE_INVARIANCE_CASE,
                "changing the unit of one coordinate changes the outcome",
            ),
        ),
    )


SCALED_IMPULSE_CASE = impact_case([[1]], [[1]], [-1], e=0, s="1/2")


def scaled_impulse() -> Statement:
    """C08, C09: one factor on the whole impulse acts as a restitution in [−1, e]; one factor per contact does not."""
    scale, after, effective = scalar("s"), vector("v⁺", "d"), scalar("eₛ")
    at_least_0, at_most_1 = NonNegative("s ≥ 0", scale), NonNegative("s ≤ 1", 1 - scale)
    names = (
        equation("the scaled impact", after, v - scale * (1 + e) * MI * J.T * G * J * v),
        equation("effective restitution", effective, scale * (1 + e) - 1),
    )
    rules = (*names, names[0].T, *MASS_RULES, ON_ROW_SPACE)
    form = v.T * J.T * G * J * v
    law = identity("Newton's law with the effective restitution", J * after, -effective * J * v, rules)
    loss = identity(
        "twice the loss of kinetic energy", v.T * M * v - after.T * M * after, (1 - effective * effective) * form, rules
    )
    above = positivity("eₛ ≥ −1", 1 + effective, (Term(1, (at_least_0, E_AT_LEAST_MINUS_ONE)),), rules)
    below = positivity("eₛ ≤ e", e - effective, (Term(1, (at_most_1, E_AT_LEAST_MINUS_ONE)),), rules)
    square = Square(MI * J.T * G * J * v, DEFINITE_MASS)
    passive = positivity(
        "the kinetic energy does not grow",
        (1 - effective * effective) * form,
        (Term(1, (E_AT_MOST_ONE, above.claim), square), Term(1, (below.claim, above.claim), square)),
        (names[0], *MASS_RULES, ON_ROW_SPACE),
        "1 − eₛ² = (1 − e)(1 + eₛ) + (e − eₛ)(1 + eₛ)",
    )
    steps = (law, loss, above, below, passive)
    per_contact = matrix("S", "c", "c")
    uneven = v - (1 + e) * MI * J.T * per_contact * G * J * v
    return Statement(
        title="One scale factor is a restitution coefficient",
        source="paper VI (scaling, spreading, e = −1); C08, C09",
        statement=(
            r"Multiply the impulse by one factor $s \in [0, 1]$. The result is the impact with restitution $e_s = "
            r"s(1+e) - 1 \in [-1, e]$, so it is passive. For $s = 0$, or $e = -1$, nothing happens: only the penalty "
            r"forces remain."
        ),
        given=(*MASS, GENERALIZED_INVERSE, at_least_0, at_most_1, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=names,
        steps=(*MASS_LEMMAS, *ROW_SPACE_LEMMAS, *steps),
        concludes=tuple(step.claim.name for step in steps),
        witness=SCALED_IMPULSE_CASE,
        needed=_needed(at_least_0.name, at_most_1.name),
        twins=(
            Twin(
                "one factor per contact would be passive too",
                NonNegative("KE − KE⁺ with factors S", v.T * M * v - uneven.T * M * uneven),
                impact_case([[1, 0], [0, 1]], [[1, 0], [-1, 1]], [0, -1], e=1, s=1, S=[[1, 0], [0, 0]]),
                "the factor removes the impulse that brakes; the impulse of the other contact remains",
            ),
        ),
    )


def _needed(at_least_0: str, at_most_1: str) -> tuple[Without, ...]:
    null = {"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}
    return (
        Without(SYMMETRIC_MASS.name, SCALED_IMPULSE_CASE.with_values(skew)),
        Without(INVERSE_MASS.name, SCALED_IMPULSE_CASE.with_values(M=[[2]])),
        Without(DEFINITE_MASS.name, SCALED_IMPULSE_CASE.with_values(null)),
        Without(GENERALIZED_INVERSE.name, SCALED_IMPULSE_CASE.with_values(G=[[3]])),
        Without(at_least_0, SCALED_IMPULSE_CASE.with_values(s=-1)),
        Without(at_most_1, SCALED_IMPULSE_CASE.with_values(s=3)),
        Without(E_AT_MOST_ONE.name, SCALED_IMPULSE_CASE.with_values(e=2, s=1)),
        Without(E_AT_LEAST_MINUS_ONE.name, SCALED_IMPULSE_CASE.with_values(e=-2)),
    )


LOSS_WITHOUT_STIFFNESS_CASE = instance({"M": [[1]], "M⁻¹": [[1]], "v⁺": [-1], "F": [3]}, h=1)


def loss_without_stiffness() -> Statement:
    """C17: the energy loss of an impact does not depend on finite contact forces, for any stiffness and damping."""
    after, later, force, h = vector("v⁺", "d"), vector("vₕ", "d"), vector("F", "d"), scalar("h")
    name = equation("finite forces F (springs, dampers, the hand) act for a time h", later, after + h * MI * force)
    change = identity(
        "what F adds to twice the energy",
        later.T * M * later - after.T * M * after,
        2 * h * after.T * force + h * h * force.T * MI * force,
        (name, name.T, *MASS_RULES),
        "every term carries a factor h: nothing is left for h → 0",
    )
    return Statement(
        title="Stiffness and damping take no part in the impact",
        source="paper II, V (8); C17",
        statement=(
            r"The impact (21) holds neither stiffness nor damping. Whatever finite force $F$ the springs and dampers "
            r"exert during the impact's duration $h$, it changes twice the kinetic energy by $2 h \, {v^+}^\top F + "
            r"h^2 F^\top M^{-1} F$, which vanishes with $h$."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS),
        definitions=(name,),
        steps=(*MASS_LEMMAS, change),
        concludes=(change.claim.name,),
        witness=LOSS_WITHOUT_STIFFNESS_CASE,
        needed=(
            Without(
                SYMMETRIC_MASS.name,
                instance({"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "v⁺": [1, 0], "F": [1, 0]}, h=1).with_values(
                    F=[0, 1]
                ),
            ),
            Without(INVERSE_MASS.name, LOSS_WITHOUT_STIFFNESS_CASE.with_values(M=[[2]])),
        ),
        twins=(
            Twin(
                "the same statement for a penalty contact, which needs a finite time",
                equation("F changes nothing", later.T * M * later, after.T * M * after),
                LOSS_WITHOUT_STIFFNESS_CASE,
                "a spring and damper that push with 3 N for 1 s: the loss depends on them, unlike that of an impact",
            ),
        ),
    )
