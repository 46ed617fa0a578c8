"""Floating point 1: a projector whose basis is not quite orthonormal. No condition number occurs."""

from verification.proofs.algebra import matrix, scalar, vector
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term
from verification.proofs.vocabulary import E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE, e

CASE = instance(Q=[[1]], u=[1], δ="1/4", e=1)


def statement() -> Statement:
    q, u, after, delta = matrix("Q", "d", "r"), vector("u", "d"), vector("u⁺", "d"), scalar("δ")
    name = equation("the computed impact", after, u - (1 + e) * q * q.T * u)
    near = NonNegative("Qᵀ Q ⪯ (1 + δ) I", 1 + delta - q.T * q)
    small = NonNegative("δ ≥ 0", delta)
    s = q.T * u
    range_ = (E_AT_LEAST_MINUS_ONE, E_AT_MOST_ONE)
    both = (E_AT_LEAST_MINUS_ONE, E_AT_LEAST_MINUS_ONE)
    first = positivity(
        "|u⁺|² ≤ |u|² + (1+e)² δ |Qᵀu|²",
        u.T * u + (1 + e) * (1 + e) * delta * s.T * s - after.T * after,
        (Term(1, range_, Square(s)), Term(1, both, Square(s, near))),
        (name, name.T),
    )
    second = positivity(
        "(1+δ) |Qᵀu|² ≤ (1+δ)² |u|²",
        (1 + delta) * (1 + delta) * u.T * u - (1 + delta) * s.T * s,
        (Term(1, (), Square((1 + delta) * u - q * s)), Term(1, (), Square(s, near))),
    )
    bound = (1 + delta) * (1 + (1 + e) * (1 + e) * delta * (1 + delta))
    third = positivity(
        "|u⁺|² ≤ (1 + (1+e)² δ (1+δ)) |u|², times 1 + δ",
        bound * u.T * u - (1 + delta) * after.T * after,
        (
            Term(1, (), first.claim),
            Term(1, (small,), first.claim),
            Term(1, (*both, small), second.claim),
        ),
    )
    return Statement(
        name="fp_projector",
        title="Floating point: the projector keeps the energy whatever the conditioning",
        source="docs/theory.md",
        statement=(
            r"Let $Q^\top Q \leq (1+\delta) I$. Then $u^+ = u - (1+e) Q Q^\top u$ has "
            r"$|u^+|^2 \leq (1 + (1+e)^2 \delta (1+\delta)) |u|^2 \leq (1 + 4 \delta (1+\delta)) |u|^2$ for "
            r"$e \in [-1, 1]$. Neither $M$ nor $J$ nor any rank decision enters."
        ),
        given=(near, small, *range_),
        definitions=(name,),
        steps=(first, second, third),
        concludes=(first.claim.name, third.claim.name),
        witness=CASE,
        needed=(
            Without(near.name, CASE.with_values(Q=[[3]])),
            Without(small.name, CASE.with_values(Q=[[0]], δ="-1/2")),
            Without(E_AT_LEAST_MINUS_ONE.name, CASE.with_values(e=-3)),
            Without(E_AT_MOST_ONE.name, CASE.with_values(δ=0, e=2)),
        ),
        twins=(
            Twin(
                "the energy never grows, however Q was rounded",
                NonNegative("|u⁺|² ≤ |u|²", u.T * u - after.T * after),
                CASE.with_values(Q=[["9/8"]], δ="17/64"),
                "a basis vector too long by 1/8",
            ),
        ),
        remarks=(
            r"With $\|Q^\top Q - I\| \leq \delta$ measured or bounded (bounds.orthogonality_bound: about $9 "
            r"d^{5/2} u$ for a re-orthogonalised basis) and the rounding of the two products, $2(\gamma_d + "
            r"\gamma_{d+2} + u)\sqrt{d}$, this is bounds.projector_bound: a constant that depends on $d$ "
            r"only.",
        ),
    )
