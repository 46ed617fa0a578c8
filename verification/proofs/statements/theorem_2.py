"""Theorem 2: any number of contacts, independent or not, with any {1}-inverse of the Delassus matrix."""

from verification.proofs.algebra import vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
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

POINT_MASS = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "G": [[1]], "v": [-1]}, e=0)


def statement() -> Statement:
    after = vector("v⁺", "d")
    impact = equation("the impact (21)", after, v - (1 + e) * MI * J.T * G * J * v)
    rules = (impact, impact.T, *MASS_RULES, ON_ROW_SPACE)
    loss_form = v.T * J.T * G * J * v
    twice_the_loss = v.T * M * v - after.T * M * after
    loss = identity(
        "twice the loss of kinetic energy",
        twice_the_loss,
        (1 - e * e) * loss_form,
        rules,
        "put the impact into v⁺ᵀ M v⁺; the last term holds J M⁻¹ Jᵀ G J = J",
    )
    passive = positivity(
        "the kinetic energy does not grow",
        (1 - e * e) * loss_form,
        (Term(1, (E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE), Square(MI * J.T * G * J * v, DEFINITE_MASS)),),
        rules,
        "(1−e)(1+e) times twice the kinetic energy of the velocity M⁻¹ Jᵀ G J v",
    )
    law = identity("Newton's restitution law (15)", J * after, -e * J * v, rules, "J M⁻¹ Jᵀ G J = J")
    return Statement(
        name="theorem_2",
        title="Theorem 2: simultaneous contacts, redundant ones included, never create energy",
        source="paper (20)-(24), Appendix II (34), with the factor ½ that (24) lost; C01, C02, C04, C08",
        statement=(
            r"Let $v^+ = v - (1+e) M^{-1} J^\top G J v$, where $G$ is any matrix with $W G W = W$ for $W = "
            r"J M^{-1} J^\top$ (the Moore-Penrose inverse $W^\dagger$ is one). Then $J v^+ = -e J v$ and "
            r"$KE^+ = KE - \frac12 (1-e^2) \, v^\top J^\top G J v \leq KE$ for every $e \in [-1, 1]$, every "
            r"number $c$ of contacts and every rank of $J$."
        ),
        given=(*MASS, GENERALIZED_INVERSE, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=(impact,),
        steps=(*MASS_LEMMAS, *ROW_SPACE_LEMMAS, loss, passive, law),
        concludes=(loss.claim.name, passive.claim.name, law.claim.name),
        witness=impact_case([[2, 1], [1, 2]], [[1, 0], [1, 0], [2, 0]], [-3, 1], e="1/3"),
        needed=_needed(),
        twins=_twins(twice_the_loss, loss_form),
        remarks=(
            r"Of the four Penrose equations only the first, $W G W = W$, is used: the other three are not "
            r"needed, so they are not among the hypotheses.",
            r"$e = 1$ conserves the energy (C04), $e = -1$ leaves the velocity as it is (C09).",
        ),
    )


def _twins(twice_the_loss, loss_form) -> tuple[Twin, ...]:  # type: ignore[no-untyped-def]
    doubled = impact_case([[1]], [[1], [1]], [-1], e=0)
    return (
        Twin(
            "the loss as (24) prints it, without the half",
            equation("KE − KE⁺ as printed", twice_the_loss, 2 * (1 - e * e) * loss_form),
            doubled,
            "one wall reported twice",
        ),
        Twin(
            "the loss is (1−e)² times the form",
            equation("KE − KE⁺ with (1−e)²", twice_the_loss, (1 - e) * (1 - e) * loss_form),
            doubled.with_values(e="1/2"),
        ),
    )


def _needed() -> tuple[Without, ...]:
    skew = instance(
        {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}, e=0
    )
    null = instance(
        {"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}, e=0
    )
    return (
        Without(SYMMETRIC_MASS.name, skew, "a mass matrix with a skew part has no energy theorem"),
        Without(INVERSE_MASS.name, POINT_MASS.with_values(M=[[2]]), "M⁻¹ must be the inverse of this M"),
        Without(
            DEFINITE_MASS.name, null, "here J M⁻¹ Jᵀ = 0, so every G qualifies and none restores anything"
        ),
        Without(GENERALIZED_INVERSE.name, POINT_MASS.with_values(G=[[3]]), "three times the impulse"),
        Without(E_AT_MOST_ONE.name, POINT_MASS.with_values(e=2), "e = 2 doubles the speed"),
        Without(E_AT_LEAST_MINUS_ONE.name, POINT_MASS.with_values(e=-2), "e = −2 doubles the speed, inwards"),
    )
