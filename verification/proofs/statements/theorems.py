"""Theorems 1 and 2, and the equations from which they follow."""

from __future__ import annotations

from verification.proofs.algebra import equation, matrix, vector
from verification.proofs.exact import impact_case, instance
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Square, Term, identity, positivity
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    E_AT_LEAST_MINUS_ONE,
    E_AT_MOST_ONE,
    GENERALIZED_INVERSE,
    INVERSE_MASS,
    INVERSE_SYMMETRIC,
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

THEOREM_1_POINT_MASS = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "ω": [[1]], "v": [-1]}, e=0)


def theorem_1() -> Statement:
    """Theorem 1, for one contact: the energy loss is the stated quadratic form with the factor one half."""
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
        title="Theorem 1: an impact at one contact never creates energy",
        source="paper (18)-(19), Appendix I (27)-(32), with the factor ½ that is missing in (18)",
        statement=(
            r"Let $v^+ = v - (1+e) M^{-1} J^\top \omega J v$ with one row $J$ and $\omega = (J M^{-1} J^\top)^{-1}$. "
            r"Then $J v^+ = -e J v$ and $KE^+ = KE - \frac12 (1-e^2) \, v^\top J^\top \omega J v \leq KE$ for every "
            r"$e \in [-1, 1]$ and every number $d$ of degrees of freedom."
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
        needed=_theorem_1_needed(inverse.name),
        twins=(
            Twin(
                "the loss as (18) prints it, without the half",
                equation("KE − KE⁺ as printed", twice_the_loss, 2 * (1 - e * e) * loss_form),
                THEOREM_1_POINT_MASS,
                "a point mass m = 1 at v = −1 with e = 0 has ½ to lose; (18) takes 1 from it",
            ),
        ),
    )


def _theorem_1_needed(inverse: str) -> tuple[Without, ...]:
    skew = instance({"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "ω": [[1]], "v": [1, 0]}, e=0)
    negative = THEOREM_1_POINT_MASS.with_values(**{"M": [[-1]], "M⁻¹": [[-1]], "ω": [[-1]]})
    return (
        Without(SYMMETRIC_MASS.name, skew, "a mass matrix with a skew part has no energy theorem"),
        Without(INVERSE_MASS.name, THEOREM_1_POINT_MASS.with_values(M=[[2]]), "M⁻¹ must be the inverse of this M"),
        Without(DEFINITE_MASS.name, negative, "a negative mass gains the energy that it should lose"),
        Without(
            inverse, THEOREM_1_POINT_MASS.with_values(ω=[[3]]), "three times the impulse returns the mass twice as fast"
        ),
        Without(E_AT_MOST_ONE.name, THEOREM_1_POINT_MASS.with_values(e=2), "e = 2 doubles the speed"),
        Without(E_AT_LEAST_MINUS_ONE.name, THEOREM_1_POINT_MASS.with_values(e=-2), "e = −2 doubles the speed, inwards"),
    )


THEOREM_2_POINT_MASS = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "G": [[1]], "v": [-1]}, e=0)


def theorem_2() -> Statement:
    """Theorem 2, for any number of contacts, independent or not, and any {1}-inverse of the Delassus matrix."""
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
        title="Theorem 2: an impact at simultaneous contacts, redundant ones included, never creates energy",
        source="paper (20)-(24), Appendix II (34), with the factor ½ that is missing in (24); C01, C02, C04, C08",
        statement=(
            r"Let $v^+ = v - (1+e) M^{-1} J^\top G J v$, where $G$ is any matrix with $W G W = W$ for $W = J M^{-1} "
            r"J^\top$ (the Moore-Penrose inverse $W^\dagger$ is one). Then $J v^+ = -e J v$ and $KE^+ = KE - \frac12 "
            r"(1-e^2) \, v^\top J^\top G J v \leq KE$ for every $e \in [-1, 1]$, every number $c$ of contacts and "
            r"every rank of $J$."
        ),
        given=(*MASS, GENERALIZED_INVERSE, E_AT_MOST_ONE, E_AT_LEAST_MINUS_ONE),
        definitions=(impact,),
        steps=(*MASS_LEMMAS, *ROW_SPACE_LEMMAS, loss, passive, law),
        concludes=(loss.claim.name, passive.claim.name, law.claim.name),
        witness=impact_case([[2, 1], [1, 2]], [[1, 0], [1, 0], [2, 0]], [-3, 1], e="1/3"),
        needed=_theorem_2_needed(),
        twins=_twins(twice_the_loss, loss_form),
        remarks=(
            r"Of the four Penrose equations only the first, $W G W = W$, is used: the other three are not needed, so "
            r"they are not among the hypotheses.",
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


def _theorem_2_needed() -> tuple[Without, ...]:
    skew = instance({"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}, e=0)
    null = instance({"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "G": [[1]], "v": [1, 0]}, e=0)
    return (
        Without(SYMMETRIC_MASS.name, skew, "a mass matrix with a skew part has no energy theorem"),
        Without(INVERSE_MASS.name, THEOREM_2_POINT_MASS.with_values(M=[[2]]), "M⁻¹ must be the inverse of this M"),
        Without(DEFINITE_MASS.name, null, "here J M⁻¹ Jᵀ = 0, so every G qualifies and none restores anything"),
        Without(GENERALIZED_INVERSE.name, THEOREM_2_POINT_MASS.with_values(G=[[3]]), "three times the impulse"),
        Without(E_AT_MOST_ONE.name, THEOREM_2_POINT_MASS.with_values(e=2), "e = 2 doubles the speed"),
        Without(E_AT_LEAST_MINUS_ONE.name, THEOREM_2_POINT_MASS.with_values(e=-2), "e = −2 doubles the speed, inwards"),
    )


CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "W⁻¹": [[1]], "v": [-1], "v⁺": [0], "p": [1]}, e=0)


def impulse_of_independent_rows() -> Statement:
    """(19) = (27): momentum balance and Newton's law determine the impulse uniquely if the rows are independent."""
    delassus_inverse, after, p = matrix("W⁻¹", "c", "c"), vector("v⁺", "d"), vector("p", "c")
    mass_inverse = equation("M⁻¹ M = I", MI * M, 1)
    inverse = equation("W⁻¹ is a left inverse of J M⁻¹ Jᵀ", delassus_inverse * W, 1)
    balance = equation("momentum balance (9)", M * after, M * v + J.T * p)
    law = equation("Newton's law (15)", J * after, -e * J * v)
    impulse = identity(
        "the impulse (19)",
        p,
        -(1 + e) * delassus_inverse * J * v,
        (mass_inverse, law),
        "p = W⁻¹ J M⁻¹ (Jᵀ p) = W⁻¹ J (v⁺ − v) = −(1+e) W⁻¹ J v",
        first=(Cofactor(-ONE, inverse, p), Cofactor(-delassus_inverse * J * MI, balance, ONE)),
    )
    return Statement(
        title="The impulse (19) is the only one",
        source="paper (19), (27)",
        statement=(
            r"If $M v^+ = M v + J^\top p$ and $J v^+ = -e J v$, and $W = J M^{-1} J^\top$ is invertible, then $p = "
            r"-(1+e) W^{-1} J v$."
        ),
        given=(mass_inverse, inverse, balance, law),
        steps=(impulse,),
        concludes=(impulse.claim.name,),
        witness=CASE,
        needed=(
            Without(mass_inverse.name, CASE.with_values(**{"M⁻¹": [[2]], "W⁻¹": [["1/2"]]})),
            Without(
                inverse.name,
                instance(
                    {"M": [[1]], "M⁻¹": [[1]], "J": [[1], [1]], "W⁻¹": [["1/4", "1/4"], ["1/4", "1/4"]]},
                    v=[-1],
                    p=[1, 0],
                    e=0,
                ).with_values(**{"v⁺": [0]}),
                "one wall reported twice: any split of the impulse between the two rows is a solution, and (19) gives "
                "one of them",
            ),
            Without(balance.name, CASE.with_values(p=[7])),
            Without(law.name, CASE.with_values(**{"v⁺": [1], "p": [2]})),
        ),
        twins=(
            Twin(
                "an impulse without the 1 + e",
                equation("p = −e W⁻¹ J v", p, -e * delassus_inverse * J * v),
                CASE,
                "a plastic collision would need no impulse",
            ),
        ),
    )


def dynamically_consistent_inverse() -> Statement:
    """(28)-(31): the dynamically consistent inverse, and the identity on which Appendix I is based."""
    wi, bar = matrix("W⁻¹", "c", "c"), matrix("J̄", "d", "c")
    inverse = equation("W W⁻¹ = I for W = J M⁻¹ Jᵀ", W * wi, 1)
    definition = equation("dynamically consistent inverse", bar, MI * J.T * wi)
    symmetric = identity(
        "W⁻¹ is symmetric",
        wi.T,
        wi,
        (INVERSE_SYMMETRIC.claim,),
        "W⁻ᵀ = W⁻ᵀ (W W⁻¹) = (W W⁻¹)ᵀ W⁻¹, because W is symmetric",
        first=(Cofactor(-wi.T, inverse, ONE), Cofactor(ONE, inverse.T, wi)),
    )
    rules = (definition, definition.T, *MASS_RULES, symmetric.claim, inverse)
    right = identity("J̄ is a right inverse of J", J * bar, 1, rules)
    twenty_nine = identity("(29)", M * bar * J, J.T * bar.T * M, rules, "both sides are Jᵀ W⁻¹ J")
    thirty = identity("(30)", J.T * bar.T * M * bar * J, M * bar * J, rules, "W⁻¹ W W⁻¹ = W⁻¹")
    euclid = matrix("J⁺", "d", "c")
    half = ["1/2"]
    case = instance(
        {"M": [[1, 0], [0, 2]], "M⁻¹": [[1, 0], [0, "1/2"]], "J": [[1, 1]], "W⁻¹": [["2/3"]], "J⁺": [half, half]}
    )
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 0]], "W⁻¹": [[1]]}
    return Statement(
        title="The dynamically consistent inverse",
        source="paper (28)-(31), Appendix I",
        statement=(
            r"With $\bar J = M^{-1} J^\top W^{-1}$ and $W = J M^{-1} J^\top$ invertible: $J \bar J = I$, $M \bar J J "
            r"= J^\top \bar J^\top M$ and $J^\top \bar J^\top M \bar J J = M \bar J J$; so $\bar J J$ is the "
            r"projector, orthogonal in the kinetic metric, that the impact (28) applies."
        ),
        given=(SYMMETRIC_MASS, INVERSE_MASS, inverse),
        definitions=(definition,),
        steps=(*MASS_LEMMAS, symmetric, right, twenty_nine, thirty),
        concludes=(right.claim.name, "(29)", "(30)"),
        witness=case,
        needed=(
            Without(SYMMETRIC_MASS.name, instance(skew), "(29) fails for a mass matrix that is not symmetric"),
            Without(INVERSE_MASS.name, case.with_values(M=[[3, 0], [0, 1]])),
            Without(inverse.name, case.with_values(**{"W⁻¹": [[1]]})),
        ),
        twins=(
            Twin(
                "the plain pseudo-inverse of J would do as well",
                equation("(29) with J⁺ = Jᵀ (J Jᵀ)⁻¹", M * euclid * J, J.T * euclid.T * M),
                case,
                "J⁺ does not depend on the masses",
            ),
        ),
    )


TWICE = instance(
    {
        "W": [[1, 1], [1, 1]],
        "G": [["1/4", "1/4"], ["1/4", "1/4"]],
        "E": [[1, 0], [0, 1]],
        "γ⁻": [-1, -1],
        "p": [2, 0],
        "z": [1, 0],
    }
)


def newton_law_solvable() -> Statement:
    """Newton's law has a solution if and only if the required change is in the range of the Delassus matrix."""
    w, g, restitution = (matrix(name, "c", "c") for name in ("W", "G", "E"))
    gamma, p, z, b = (vector(name, "c") for name in ("γ⁻", "p", "z", "b"))
    wanted = equation("wanted change of normal velocities", b, -(1 + restitution) * gamma)
    solution = equation("p meets Newton's law", w * p, b)
    inverse = equation("G is a {1}-inverse of W", w * g * w, w)
    consistent = identity(
        "the law is consistent",
        w * g * b,
        b,
        (inverse,),
        "W G b = W G W p = W p = b",
        first=(Cofactor(-w * g, solution, ONE), Cofactor(ONE, solution, ONE)),
    )
    family = identity("every such impulse meets the law", w * (g * b + (1 - g * w) * z), b, (consistent.claim, inverse))
    all_of_them = identity("every solution is of this form", p, g * b + (1 - g * w) * p, (solution,), "G b = G W p")
    return Statement(
        title="When Newton's law can be met",
        source="paper (15), (20); docs/theory.md (unequal restitution)",
        statement=(
            r"Let $b = -(I+E)\gamma^-$ and $W G W = W$. Some impulse $p$ gives every contact its own restitution, $W "
            r"p = b$, if and only if $W G b = b$; the solutions are then $p = G b + (I - G W) z$ with $z$ arbitrary. "
            r"(The converse needs no more words: $W G b = b$ shows $p = G b$.)"
        ),
        given=(solution, inverse),
        definitions=(wanted,),
        steps=(consistent, family, all_of_them),
        concludes=(consistent.claim.name, family.claim.name, all_of_them.claim.name),
        witness=TWICE,
        needed=(
            Without(
                solution.name,
                TWICE.with_values(E=[[1, 0], [0, 0]]),
                "one wall reported twice with e = 1 and e = 0: no impulse can do both",
            ),
            Without(inverse.name, TWICE.with_values(G=[[1, 0], [0, 1]])),
        ),
        twins=(Twin("the impulse is unique", equation("p = G b", p, g * b), TWICE,
                    "the impulse can be split arbitrarily between the rows"),),  # fmt: skip
        remarks=(
            r"With one scalar $e$ for all contacts $b = -(1+e) J v$ lies in the range of $J$, which is the range of "
            r"$W$ for a positive definite $M$: then the law can always be met (theorem_2).",
        ),
    )
