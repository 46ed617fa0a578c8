"""When Newton's law can be met: exactly when the wanted change lies in the range of the Delassus matrix."""

from verification.proofs.algebra import matrix, vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import ONE

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


def statement() -> Statement:
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
    family = identity(
        "every such impulse meets the law", w * (g * b + (1 - g * w) * z), b, (consistent.claim, inverse)
    )
    all_of_them = identity(
        "every solution is of this form", p, g * b + (1 - g * w) * p, (solution,), "G b = G W p"
    )
    return Statement(
        name="newton_law_solvable",
        title="When Newton's law can be met",
        source="paper (15), (20); docs/theory.md (unequal restitution)",
        statement=(
            r"Let $b = -(I+E)\gamma^-$ and $W G W = W$. Some impulse $p$ gives every contact its own "
            r"restitution, $W p = b$, if and only if $W G b = b$; the solutions are then $p = G b + (I - G "
            r"W) z$ with $z$ arbitrary. (The converse needs no more words: $W G b = b$ shows $p = G b$.)"
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
        twins=(
            Twin(
                "the impulse is unique", equation("p = G b", p, g * b), TWICE, "the push may be split at will"
            ),
        ),
        remarks=(
            r"With one scalar $e$ for all contacts $b = -(1+e) J v$ lies in the range of $J$, which is the "
            r"range of $W$ for a positive definite $M$: then the law can always be met (theorem_2).",
        ),
    )
