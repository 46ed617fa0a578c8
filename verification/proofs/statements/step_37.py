"""(37): what the printed matrix is (a {1,2}-inverse), and what it is not (the Moore-Penrose inverse)."""

from verification.proofs.algebra import matrix
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.vocabulary import MI, J, W

# J = (1, 1)ᵀ: Jₙ = 1, and (36) holds with A = −1, so P = [[1, 0], [−1, 1]]
CASE = instance(
    {
        "M⁻¹": [[1]],
        "Jₙ": [[1]],
        "S": [[1], [1]],
        "R": [[1, 0]],
        "Wₙ⁻¹": [[1]],
        "P": [[1, 0], [-1, 1]],
    }
)


def statement() -> Statement:
    jn, s, r, wi = (
        matrix("Jₙ", "n", "d"),
        matrix("S", "c", "n"),
        matrix("R", "n", "c"),
        matrix("Wₙ⁻¹", "n", "n"),
    )
    p, printed = matrix("P", "c", "c"), matrix("X", "c", "c")
    rows = equation("all rows from the chosen ones", J, s * jn)
    definition = equation("the matrix printed in (37)", printed, p.T * r.T * wi * r * p)
    eliminate = equation("the first block row of P is (I 0): R P = R", r * p, r)
    choice = equation("R S = I", r * s, 1)
    right = equation("Wₙ Wₙ⁻¹ = I", jn * MI * jn.T * wi, 1)
    rules = (rows, rows.T, definition, definition.T, eliminate, eliminate.T, choice, choice.T, right)
    simple = identity("(37) is Rᵀ Wₙ⁻¹ R", printed, r.T * wi * r, rules, "the factors P act on nothing")
    first = identity("Penrose 1", W * printed * W, W, rules)
    second = identity("Penrose 2", printed * W * printed, printed, rules)
    conclusion = identity("(41)", J.T * printed * J, jn.T * wi * jn, rules)
    return Statement(
        name="step_37",
        title="What (37) computes is not the Moore-Penrose inverse",
        source="paper (36)-(41); erratum 2",
        statement=(
            r"With $P = \begin{pmatrix} I & 0 \\ A & I \end{pmatrix}$ and $R = (I \; 0)$, the matrix $X = "
            r"P^\top R^\top W_n^{-1} R P$ of (37) is just $R^\top W_n^{-1} R$. It satisfies $W X W = W$ and "
            r"$X W X = X$, and (41) follows; but $W X$ is not symmetric, so $X \neq W^\dagger$."
        ),
        given=(eliminate, choice, right),
        definitions=(rows, definition),
        steps=(simple, first, second, conclusion),
        concludes=(simple.claim.name, "Penrose 1", "Penrose 2", "(41)"),
        witness=CASE,
        needed=(
            Without(eliminate.name, CASE.with_values(P=[[2, 0], [-1, 1]])),
            Without(choice.name, CASE.with_values(S=[[2], [1]])),
            Without(right.name, CASE.with_values(**{"Wₙ⁻¹": [[2]]})),
        ),
        twins=(
            Twin(
                "(37) as printed: X is the Moore-Penrose inverse",
                equation("Penrose 3: W X is symmetric", (W * printed).T, W * printed),
                CASE,
                "one wall reported twice is the smallest case: X = [1 0; 0 0], while W† = ¼ [1 1; 1 1]",
            ),
        ),
        remarks=(
            r"The slip is the reverse-order law $(P^{-1} Y P^{-\top})^\dagger = P^\top Y^\dagger P$, see "
            r"reverse_order_law; (38), on which the paper bases it, is itself right.",
        ),
    )
