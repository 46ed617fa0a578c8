"""Poisson's law by two LCPs is passive for every restitution matrix with entries of I − E not negative."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import Entrywise, NonNegative, equation
from verification.proofs.rewriting import identity, positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Pairing, Square, Term
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    INVERSE_MASS,
    MASS,
    MASS_LEMMAS,
    MASS_RULES,
    MI,
    ONE,
    SYMMETRIC_MASS,
    J,
    M,
    v,
)

BALL = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "E": [["1/2"]], "p": [1], "z": [0], "v": [-1]})
# W = [2 −2; −2 4]: compression p = (2, 1) stops both; with e = (1, 0) the second contact must push again
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


def statement() -> Statement:
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
        first=(
            Cofactor(-4 * ONE, first, ONE),
            Cofactor(-2 * ONE, second, ONE),
        ),
    )
    passive = positivity(
        "the kinetic energy does not grow",
        loss.claim.rhs,
        (Term(1, (), Square(gap, DEFINITE_MASS)), Term(2, (), Pairing(open_, pushes, inelastic))),
    )
    doubled = v + MI * J.T * (1 + restitution) * p
    return Statement(
        name="poisson_two_lcps",
        title="Poisson's law by two LCPs is passive",
        source="docs/theory.md (unequal restitution); Glocker and Pfeiffer",
        statement=(
            r"Compression: $v_k = v + M^{-1} J^\top p$, $0 \leq p \perp J v_k$. Restitution: $v^+ = v_k + "
            r"M^{-1} J^\top p_e$, $p_e - E p \perp J v^+ \geq 0$, with $E$ diagonal and $e_i \leq 1$. For "
            r"any velocity $v$ twice the loss is $(p - p_e)^\top W (p - p_e) + 2 (J v^+)^\top (I - E) p "
            r"\geq 0$."
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
        remarks=(
            r"$e_i \geq 0$, $J v_k \geq 0$ and $p_e \geq E p$ belong to the law; passivity does not need "
            r"them.",
        ),
    )


def _needed(names: tuple[str, ...]) -> tuple[Without, ...]:
    pushes, open_, inelastic, first, second = names
    skew = {"M": [[1, 1], [0, 1]], "M⁻¹": [[1, -1], [0, 1]], "J": [[1, 1]], "E": [[0]], "v": [-1, 0]}
    return (
        Without(SYMMETRIC_MASS.name, BALL.with_values(skew)),
        Without(INVERSE_MASS.name, BALL.with_values(M=[[2]])),
        Without(DEFINITE_MASS.name, BALL.with_values({"M": [[-1]], "M⁻¹": [[-1]], "v": [1]}, E=[[0]])),
        Without(pushes, BALL.with_values(E=[[-5]], p=[-1], v=[1]), "a compression that pulls"),
        Without(open_, BALL.with_values(E=[[-5]]), "a restitution that throws the body into the wall"),
        Without(inelastic, BALL.with_values(E=[[2]])),
        Without(first, BALL.with_values(p=[2], z=[0], E=[[1]])),
        Without(second, BALL.with_values(z=[5])),
    )
