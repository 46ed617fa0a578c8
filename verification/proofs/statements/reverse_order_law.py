"""The reverse-order law that (37) uses holds for orthogonal P, and only the orthogonality makes it hold."""

from verification.proofs.algebra import matrix
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without

CASE = instance(P=[[0, 1], [1, 0]], Y=[[1, 0], [0, 0]]).with_values(**{"Y†": [[1, 0], [0, 0]]})


def statement() -> Statement:
    p, y, plus, z, x = (matrix(name, "c", "c") for name in ("P", "Y", "Y†", "Z", "X"))
    orthogonal = equation("P Pᵀ = I", p * p.T, 1)
    penrose = (
        equation("Penrose 1 of Y†", y * plus * y, y),
        equation("Penrose 2 of Y†", plus * y * plus, plus),
        equation("Penrose 3 of Y†", (y * plus).T, y * plus),
        equation("Penrose 4 of Y†", (plus * y).T, plus * y),
    )
    names = (equation("the matrix", z, p.T * y * p), equation("its candidate", x, p.T * plus * p))
    rules = (*names, *(name.T for name in names), orthogonal, *penrose)
    steps = (
        identity("Penrose 1", z * x * z, z, rules),
        identity("Penrose 2", x * z * x, x, rules),
        identity("Penrose 3", (z * x).T, z * x, rules),
        identity("Penrose 4", (x * z).T, x * z, rules),
    )
    return Statement(
        name="reverse_order_law",
        title="The reverse-order law, where it holds",
        source="paper (37)-(38); Penrose 1955",
        statement=(
            r"If $P P^\top = I$, then $P^\top Y^\dagger P$ is the Moore-Penrose inverse of $P^\top Y P$ "
            r"(here $P^{-1} = P^\top$, so this is the step of (37) with an orthogonal $P$)."
        ),
        given=(orthogonal, *penrose),
        definitions=names,
        steps=steps,
        concludes=tuple(step.claim.name for step in steps),
        witness=CASE,
        needed=(
            Without(orthogonal.name, CASE.with_values(P=[[1, 1], [0, 1]]), "a shear, like the P of (37)"),
            Without(penrose[0].name, CASE.with_values(**{"Y†": [[0, 0], [0, 0]]})),
            Without(penrose[1].name, CASE.with_values(**{"Y†": [[1, 0], [0, 1]]})),
            Without(penrose[2].name, CASE.with_values(**{"Y†": [[1, 1], [0, 0]]})),
            Without(penrose[3].name, CASE.with_values(**{"Y†": [[1, 0], [1, 0]]})),
        ),
        twins=(
            Twin(
                "the factors may be put the other way round",
                equation("Z (P Y† Pᵀ) Z = Z", z * p * plus * p.T * z, z),
                instance(
                    {"P": [["3/5", "-4/5"], ["4/5", "3/5"]], "Y": [[1, 0], [0, 0]], "Y†": [[1, 0], [0, 0]]}
                ),
            ),
        ),
    )
