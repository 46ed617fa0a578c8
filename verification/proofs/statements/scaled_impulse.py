"""C08, C09: scaling the impulse by one factor is a restitution in [−1, e]; a factor per contact is not."""

from verification.proofs.algebra import matrix, scalar, vector
from verification.proofs.facts import NonNegative, equation
from verification.proofs.linear import impact_case
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term
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
    ROW_SPACE_LEMMAS,
    SYMMETRIC_MASS,
    G,
    J,
    M,
    e,
    v,
)

CASE = impact_case([[1]], [[1]], [-1], e=0, s="1/2")


def statement() -> Statement:
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
        "twice the loss of kinetic energy",
        v.T * M * v - after.T * M * after,
        (1 - effective * effective) * form,
        rules,
    )
    above = positivity("eₛ ≥ −1", 1 + effective, (Term(1, (at_least_0, E_AT_LEAST_MINUS_ONE)),), rules)
    below = positivity("eₛ ≤ e", e - effective, (Term(1, (at_most_1, E_AT_LEAST_MINUS_ONE)),), rules)
    square = Square(MI * J.T * G * J * v, DEFINITE_MASS)
    passive = positivity(
        "the kinetic energy does not grow",
        (1 - effective * effective) * form,
        (
            Term(1, (E_AT_MOST_ONE, above.claim), square),
            Term(1, (below.claim, above.claim), square),
        ),
        (names[0], *MASS_RULES, ON_ROW_SPACE),
        "1 − eₛ² = (1 − e)(1 + eₛ) + (e − eₛ)(1 + eₛ)",
    )
    steps = (law, loss, above, below, passive)
    per_contact = matrix("S", "c", "c")
    uneven = v - (1 + e) * MI * J.T * per_contact * G * J * v
    return Statement(
        name="scaled_impulse",
        title="One scale factor is a restitution coefficient",
        source="paper VI (scaling, spreading, e = −1); C08, C09",
        statement=(
            r"Multiply the impulse by one factor $s \in [0, 1]$. The result is the impact with restitution "
            r"$e_s = s(1+e) - 1 \in [-1, e]$, so it is passive. For $s = 0$, or $e = -1$, nothing happens: "
            r"only the penalty forces remain."
        ),
        given=(*MASS, GENERALIZED_INVERSE, at_least_0, at_most_1, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=names,
        steps=(*MASS_LEMMAS, *ROW_SPACE_LEMMAS, *steps),
        concludes=tuple(step.claim.name for step in steps),
        witness=CASE,
        needed=_needed(at_least_0.name, at_most_1.name),
        twins=(
            Twin(
                "one factor per contact would be passive too",
                NonNegative("KE − KE⁺ with factors S", v.T * M * v - uneven.T * M * uneven),
                impact_case([[1, 0], [0, 1]], [[1, 0], [-1, 1]], [0, -1], e=1, s=1, S=[[1, 0], [0, 0]]),
                "the contact that does the braking is switched off, the other one pushes",
            ),
        ),
    )


def _needed(at_least_0: str, at_most_1: str) -> tuple[Without, ...]:
    null = {"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}
    return (
        Without(SYMMETRIC_MASS.name, CASE.with_values(skew)),
        Without(INVERSE_MASS.name, CASE.with_values(M=[[2]])),
        Without(DEFINITE_MASS.name, CASE.with_values(null)),
        Without(GENERALIZED_INVERSE.name, CASE.with_values(G=[[3]])),
        Without(at_least_0, CASE.with_values(s=-1)),
        Without(at_most_1, CASE.with_values(s=3)),
        Without(E_AT_MOST_ONE.name, CASE.with_values(e=2, s=1)),
        Without(E_AT_LEAST_MINUS_ONE.name, CASE.with_values(e=-2)),
    )
