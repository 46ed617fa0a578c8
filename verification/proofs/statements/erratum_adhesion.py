"""Erratum: assumption (i), impulses at all approaching contacts, can pull. When it cannot, and a case where it does."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import Entrywise, NonNegative, equation
from verification.proofs.linear import inverse
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Pairing, Term
from verification.proofs.vocabulary import E_AT_LEAST_MINUS_ONE, J, e, v

# a point mass in a wedge: normals (1, 0) and (4/5, 3/5) at an acute angle; W⁻¹ has negative entries
WEDGE_DELASSUS = [[1, "4/5"], ["4/5", 1]]
BALL = instance({"J": [[1]], "W⁻¹": [[1]], "v": [-1], "y": [1]}, e=0)


def statement() -> Statement:
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
        name="erratum_adhesion",
        title="Erratum: impulses at all approaching contacts can pull",
        source="paper V, assumption (i); erratum 4",
        statement=(
            r"If $W^{-1}$ has no negative entry (contacts that do not push each other apart), then $-J v "
            r"\geq 0$ gives $p = -(1+e) W^{-1} J v \geq 0$. In general some $p_i$ is negative: an adhesive "
            r"contact."
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
                "what was not approaching stays so: here the opposite wall of a tight slot, row −J",
                NonNegative("−J v⁺ ≥ 0 for a unit mass, v⁺ = v + Jᵀ p", _slot()),
                BALL.with_values(e=1),
                "the rebound from one wall is an approach to the other",
            ),
        ),
    )


def _slot():  # type: ignore[no-untyped-def]
    """yᵀ (−J)(v + Jᵀ p): the velocity at the opposite wall after the impact."""
    return -vector("y", "c").T * J * (v + J.T * vector("p", "c"))
