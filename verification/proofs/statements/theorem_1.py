"""Theorem 1: one contact. The energy lost is the stated quadratic form, with the factor one half."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_LEAST_MINUS_ONE,
    E_AT_MOST_ONE,
    INVERSE_MASS,
    MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    SYMMETRIC_MASS,
    M,
    e,
    v,
)

POINT_MASS = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "ω": [[1]], "v": [-1]}, e=0)


def statement() -> Statement:
    row, omega, after = matrix("J", "1", "d"), matrix("ω", "1", "1"), vector("v⁺", "d")
    inverse = equation("ω = (J M⁻¹ Jᵀ)⁻¹", row * MI * row.T * omega, 1)
    impact = equation("the impact (9), (19)", after, v - (1 + e) * MI * row.T * omega * row * v)
    rules = (impact, impact.T, *MASS_RULES, inverse)
    loss_form = v.T * row.T * omega * row * v
    twice_the_loss = v.T * M * v - after.T * M * after
    loss = identity(
        "twice the loss of kinetic energy",
        twice_the_loss,
        (1 - e * e) * loss_form,
        rules,
        "put the impact into v⁺ᵀ M v⁺ and use J M⁻¹ Jᵀ ω = 1; −2(1+e) + (1+e)² = −(1−e²)",
    )
    root = MI * row.T * omega * row * v
    passive = positivity(
        "the kinetic energy does not grow",
        (1 - e * e) * loss_form,
        (Term(1, (E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE), Square(root, DEFINITE_MASS)),),
        rules,
        "(1−e)(1+e) times twice the kinetic energy of the velocity M⁻¹ Jᵀ ω J v",
    )
    law = identity("Newton's restitution law", row * after, -e * row * v, rules, "J M⁻¹ Jᵀ ω = 1")
    return Statement(
        name="theorem_1",
        title="Theorem 1: one contact never creates energy",
        source="paper (18)-(19), Appendix I (27)-(32), with the factor ½ that (18) lost",
        statement=(
            r"Let $v^+ = v - (1+e) M^{-1} J^\top \omega J v$ with one row $J$ and $\omega = (J M^{-1} "
            r"J^\top)^{-1}$. Then $J v^+ = -e J v$ and $KE^+ = KE - \frac12 (1-e^2) \, v^\top J^\top \omega "
            r"J v \leq KE$ for every $e \in [-1, 1]$ and every number $d$ of degrees of freedom."
        ),
        given=(*MASS, inverse, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=(impact,),
        steps=(*MASS_LEMMAS, loss, passive, law),
        concludes=(loss.claim.name, passive.claim.name, law.claim.name),
        witness=instance(
            {"M": [[2, 1], [1, 2]], "M⁻¹": [["2/3", "-1/3"], ["-1/3", "2/3"]], "J": [[1, 0]], "ω": [["3/2"]]},
            v=[1, 1],
            e="1/2",
        ),
        needed=_needed(inverse.name),
        twins=(
            Twin(
                "the loss as (18) prints it, without the half",
                equation("KE − KE⁺ as printed", twice_the_loss, 2 * (1 - e * e) * loss_form),
                POINT_MASS,
                "a point mass m = 1 at v = −1 with e = 0 has ½ to lose; (18) takes 1 from it",
            ),
        ),
    )


def _needed(inverse: str) -> tuple[Without, ...]:
    skew = instance(
        {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "ω": [[1]], "v": [1, 0]}, e=0
    )
    negative = POINT_MASS.with_values(**{"M": [[-1]], "M⁻¹": [[-1]], "ω": [[-1]]})
    return (
        Without(SYMMETRIC_MASS.name, skew, "a mass matrix with a skew part has no energy theorem"),
        Without(INVERSE_MASS.name, POINT_MASS.with_values(M=[[2]]), "M⁻¹ must be the inverse of this M"),
        Without(DEFINITE_MASS.name, negative, "a negative mass gains what it should lose"),
        Without(
            inverse, POINT_MASS.with_values(ω=[[3]]), "three times the impulse returns the mass twice as fast"
        ),
        Without(E_AT_MOST_ONE.name, POINT_MASS.with_values(e=2), "e = 2 doubles the speed"),
        Without(E_AT_LEAST_MINUS_ONE.name, POINT_MASS.with_values(e=-2), "e = −2 doubles the speed, inwards"),
    )
