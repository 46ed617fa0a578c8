"""(33) = (25): redundant rows may stay; the result is that of any maximal independent subset."""

from verification.proofs.algebra import matrix
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import MI, ONE, G, J, W

# one wall reported twice: J = (1, 1)ᵀ is S Jₙ with Jₙ = 1, S = (1, 1)ᵀ, R = (1, 0)
CASE = instance(
    {
        "M⁻¹": [[1]],
        "Jₙ": [[1]],
        "S": [[1], [1]],
        "R": [[1, 0]],
        "Wₙ⁻¹": [[1]],
        "G": [["1/4"] * 2, ["1/4"] * 2],
    }
)


def statement() -> Statement:
    jn, s, r, wi = (
        matrix("Jₙ", "n", "d"),
        matrix("S", "c", "n"),
        matrix("R", "n", "c"),
        matrix("Wₙ⁻¹", "n", "n"),
    )
    wn = jn * MI * jn.T
    rows = equation("all rows from the chosen ones", J, s * jn)
    choice = equation("R chooses them: R S = I", r * s, 1)
    left = equation("Wₙ⁻¹ Wₙ = I", wi * wn, 1)
    right = equation("Wₙ Wₙ⁻¹ = I", wn * wi, 1)
    inverse = equation("G is a {1}-inverse of J M⁻¹ Jᵀ", W * G * W, W)
    squeezed = identity(
        "Wₙ (Sᵀ G S) Wₙ = Wₙ",
        wn * s.T * G * s * wn,
        wn,
        (rows, rows.T, choice, choice.T),
        "R (W G W − W) Rᵀ with W = S Wₙ Sᵀ",
        first=(Cofactor(r, inverse, r.T),),
    )
    core = identity(
        "Sᵀ G S = Wₙ⁻¹",
        s.T * G * s,
        wi,
        (left, right),
        "multiply by Wₙ⁻¹ from both sides",
        first=(
            Cofactor(wi, squeezed.claim, wi),
            Cofactor(-ONE, left, s.T * G * s * wn * wi),
            Cofactor(-s.T * G * s, right, ONE),
        ),
    )
    result = identity("(33)", J.T * G * J, jn.T * wi * jn, (rows, rows.T, core.claim))
    return Statement(
        name="independent_subset",
        title="Redundant rows may stay",
        source="paper (25), (33), (41); C03",
        statement=(
            r"Let $J = S J_n$, where the rows of $J_n$ are independent rows of $J$ ($J_n = R J$, $R S = I$) "
            r"and $W_n = J_n M^{-1} J_n^\top$ is invertible. Then $J^\top G J = J_n^\top W_n^{-1} J_n$ for "
            r"every {1}-inverse $G$ of $J M^{-1} J^\top$, the Moore-Penrose inverse among them."
        ),
        given=(choice, left, right, inverse),
        definitions=(rows,),
        steps=(squeezed, core, result),
        concludes=("(33)",),
        witness=CASE,
        needed=(
            Without(choice.name, CASE.with_values(S=[[0], [0]], R=[[0, 0]], G=[[0, 0], [0, 0]])),
            Without(
                (left.name, right.name), CASE.with_values(**{"Wₙ⁻¹": [[2]]}), "both sides of one inverse"
            ),
            Without(inverse.name, CASE.with_values(G=[[1, 0], [0, 1]])),
        ),
        twins=(
            Twin(
                "the impulses agree as well",
                equation("G J = Rᵀ Wₙ⁻¹ Jₙ", G * J, r.T * wi * jn),
                CASE,
                "the velocities agree, the impulses at the contacts need not: W† shares the push, (37) "
                "does not",
            ),
        ),
        remarks=(
            r"No symmetry and no definiteness of $M$ is needed once $W_n$ is invertible; a positive "
            r"definite $M$ is what makes $W_n$ invertible for independent rows, (35).",
        ),
    )
