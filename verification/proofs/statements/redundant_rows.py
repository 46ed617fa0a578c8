"""Redundant rows: every {1}-inverse gives the same impact, (25), (33), and the role of (35) to (37)."""

from __future__ import annotations

from verification.proofs.algebra import NonNegative, equation, matrix, vector
from verification.proofs.exact import impact_case, instance
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cancelling, Cofactor, Square, Term, identity, positivity
from verification.proofs.vocabulary import (
    DEFINITE_MASS,
    GENERALIZED_INVERSE,
    INVERSE_MASS,
    MI,
    ON_ROW_SPACE,
    ONE,
    ROW_SPACE_LEMMAS,
    G,
    J,
    M,
    W,
    column_space_lemmas,
    on_column_space,
)


def one_inverse_invariance() -> Statement:
    """The step that is missing in the paper's proof of (33): every {1}-inverse gives the same Jᵀ G J."""
    other = matrix("H", "c", "c")
    given = equation("H is a {1}-inverse of J M⁻¹ Jᵀ", W * other * W, W)
    same = identity(
        "the {1}-inverse does not matter",
        J.T * G * J,
        J.T * other * J,
        (ON_ROW_SPACE,),
        "Jᵀ G J = (Jᵀ H W) G J = Jᵀ H (W G J) = Jᵀ H J",
        first=(Cofactor(-ONE, on_column_space(other, "H"), G * J),),
    )
    case = impact_case([[1]], [[1], [1]], [0]).with_values(H=[[1, 0], [0, 0]])
    null = {"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "G": [[1]], "H": [[2]]}
    return Statement(
        title="Every {1}-inverse gives the same impact",
        source="the step missing from Appendix III of the paper",
        statement=(
            r"If $W G W = W$ and $W H W = W$ for $W = J M^{-1} J^\top$, then $J^\top G J = J^\top H J$: the velocity "
            r"after the impact does not depend on which generalized inverse is used."
        ),
        given=(INVERSE_MASS, DEFINITE_MASS, GENERALIZED_INVERSE, given),
        steps=(*ROW_SPACE_LEMMAS, *column_space_lemmas(other, "H", given), same),
        concludes=(same.claim.name,),
        witness=case,
        needed=(
            Without(INVERSE_MASS.name, instance({**null, "M": [[1, 0], [0, 1]]})),
            Without(DEFINITE_MASS.name, instance(null), "J M⁻¹ Jᵀ = 0: anything is a {1}-inverse"),
            Without(GENERALIZED_INVERSE.name, case.with_values(G=[[1, 0], [0, 1]])),
            Without(given.name, case.with_values(H=[[1, 0], [0, 1]])),
        ),
        twins=(Twin("the impulses agree as well", equation("G J = H J", G * J, other * J), case, "they do not"),),
        remarks=(r"$M$ need not be symmetric here.",),
    )


# one wall reported twice: J = (1, 1)ᵀ is S Jₙ with Jₙ = 1, S = (1, 1)ᵀ, R = (1, 0)
INDEPENDENT_SUBSET_CASE = instance(
    {"M⁻¹": [[1]], "Jₙ": [[1]], "S": [[1], [1]], "R": [[1, 0]], "Wₙ⁻¹": [[1]], "G": [["1/4"] * 2, ["1/4"] * 2]}
)


def independent_subset() -> Statement:
    """(33) = (25): with redundant rows the result equals that of any maximal independent subset."""
    jn, s, r, wi = (matrix("Jₙ", "n", "d"), matrix("S", "c", "n"), matrix("R", "n", "c"), matrix("Wₙ⁻¹", "n", "n"))
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
        title="Redundant rows may stay",
        source="paper (25), (33), (41); C03",
        statement=(
            r"Let $J = S J_n$, where the rows of $J_n$ are independent rows of $J$ ($J_n = R J$, $R S = I$) and $W_n "
            r"= J_n M^{-1} J_n^\top$ is invertible. Then $J^\top G J = J_n^\top W_n^{-1} J_n$ for every {1}-inverse "
            r"$G$ of $J M^{-1} J^\top$, the Moore-Penrose inverse among them."
        ),
        given=(choice, left, right, inverse),
        definitions=(rows,),
        steps=(squeezed, core, result),
        concludes=("(33)",),
        witness=INDEPENDENT_SUBSET_CASE,
        needed=(
            Without(choice.name, INDEPENDENT_SUBSET_CASE.with_values(S=[[0], [0]], R=[[0, 0]], G=[[0, 0], [0, 0]])),
            Without(
                (left.name, right.name),
                INDEPENDENT_SUBSET_CASE.with_values(**{"Wₙ⁻¹": [[2]]}),
                "both sides of one inverse",
            ),
            Without(inverse.name, INDEPENDENT_SUBSET_CASE.with_values(G=[[1, 0], [0, 1]])),
        ),
        twins=(
            Twin(
                "the impulses agree as well",
                equation("G J = Rᵀ Wₙ⁻¹ Jₙ", G * J, r.T * wi * jn),
                INDEPENDENT_SUBSET_CASE,
                "the velocities agree, but the impulses at the contacts may differ: W† shares the impulse between the "
                "rows, (37) does not",
            ),
        ),
        remarks=(
            r"No symmetry and no definiteness of $M$ is needed once $W_n$ is invertible; a positive definite $M$ is "
            r"what makes $W_n$ invertible for independent rows, (35).",
        ),
    )


# J = (1, 1)ᵀ: Jₙ = 1, and (36) holds with A = −1, so P = [[1, 0], [−1, 1]]
STEP_37_CASE = instance(
    {"M⁻¹": [[1]], "Jₙ": [[1]], "S": [[1], [1]], "R": [[1, 0]], "Wₙ⁻¹": [[1]], "P": [[1, 0], [-1, 1]]}
)


def step_37() -> Statement:
    """(37): the printed matrix is a {1,2}-inverse, but not the Moore-Penrose inverse."""
    jn, s, r, wi = (matrix("Jₙ", "n", "d"), matrix("S", "c", "n"), matrix("R", "n", "c"), matrix("Wₙ⁻¹", "n", "n"))
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
        title="What (37) computes is not the Moore-Penrose inverse",
        source="paper (36)-(41); erratum 2",
        statement=(
            r"With $P = \begin{pmatrix} I & 0 \\ A & I \end{pmatrix}$ and $R = (I \; 0)$, the matrix $X = P^\top "
            r"R^\top W_n^{-1} R P$ of (37) is just $R^\top W_n^{-1} R$. It satisfies $W X W = W$ and $X W X = X$, and "
            r"(41) follows; but $W X$ is not symmetric, so $X \neq W^\dagger$."
        ),
        given=(eliminate, choice, right),
        definitions=(rows, definition),
        steps=(simple, first, second, conclusion),
        concludes=(simple.claim.name, "Penrose 1", "Penrose 2", "(41)"),
        witness=STEP_37_CASE,
        needed=(
            Without(eliminate.name, STEP_37_CASE.with_values(P=[[2, 0], [-1, 1]])),
            Without(choice.name, STEP_37_CASE.with_values(S=[[2], [1]])),
            Without(right.name, STEP_37_CASE.with_values(**{"Wₙ⁻¹": [[2]]})),
        ),
        twins=(
            Twin(
                "(37) as printed: X is the Moore-Penrose inverse",
                equation("Penrose 3: W X is symmetric", (W * printed).T, W * printed),
                STEP_37_CASE,
                "one wall reported twice is the smallest case: X = [1 0; 0 0], while W† = ¼ [1 1; 1 1]",
            ),
        ),
        remarks=(
            r"The slip is the reverse-order law $(P^{-1} Y P^{-\top})^\dagger = P^\top Y^\dagger P$, see "
            r"reverse_order_law; (38), on which the paper bases it, is itself right.",
        ),
    )


REVERSE_ORDER_LAW_CASE = instance(P=[[0, 1], [1, 0]], Y=[[1, 0], [0, 0]]).with_values(**{"Y†": [[1, 0], [0, 0]]})


def reverse_order_law() -> Statement:
    """The reverse-order law used in (37) holds for orthogonal P; without orthogonality it fails."""
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
        title="The reverse-order law, where it holds",
        source="paper (37)-(38); Penrose 1955",
        statement=(
            r"If $P P^\top = I$, then $P^\top Y^\dagger P$ is the Moore-Penrose inverse of $P^\top Y P$ (here $P^{-1} "
            r"= P^\top$, so this is the step of (37) with an orthogonal $P$)."
        ),
        given=(orthogonal, *penrose),
        definitions=names,
        steps=steps,
        concludes=tuple(step.claim.name for step in steps),
        witness=REVERSE_ORDER_LAW_CASE,
        needed=(
            Without(
                orthogonal.name, REVERSE_ORDER_LAW_CASE.with_values(P=[[1, 1], [0, 1]]), "a shear, like the P of (37)"
            ),
            Without(penrose[0].name, REVERSE_ORDER_LAW_CASE.with_values(**{"Y†": [[0, 0], [0, 0]]})),
            Without(penrose[1].name, REVERSE_ORDER_LAW_CASE.with_values(**{"Y†": [[1, 0], [0, 1]]})),
            Without(penrose[2].name, REVERSE_ORDER_LAW_CASE.with_values(**{"Y†": [[1, 1], [0, 0]]})),
            Without(penrose[3].name, REVERSE_ORDER_LAW_CASE.with_values(**{"Y†": [[1, 0], [1, 0]]})),
        ),
        twins=(
            Twin(
                "the factors may be put the other way round",
                equation("Z (P Y† Pᵀ) Z = Z", z * p * plus * p.T * z, z),
                instance({"P": [["3/5", "-4/5"], ["4/5", "3/5"]], "Y": [[1, 0], [0, 0]], "Y†": [[1, 0], [0, 0]]}),
            ),
        ),
    )


DELASSUS_DEFINITE_CASE = instance({"M": [[1]], "M⁻¹": [[1]], "J": [[1]], "K": [[1]], "x": [1], "y": [0]})
NULL = instance({"M": [[1, 0], [0, -1]], "M⁻¹": [[1, 0], [0, -1]], "J": [[1, 1]], "K": [[1], [0]], "x": [1], "y": [1]})


def delassus_definite() -> Statement:
    """(35): independent rows make the Delassus matrix positive definite, hence invertible."""
    right_inverse, x, y = matrix("K", "d", "c"), vector("x", "c"), vector("y", "c")
    independent = equation("the rows are independent: J K = I", J * right_inverse, 1)
    zero = equation("yᵀ J M⁻¹ Jᵀ y = 0", y.T * W * y, 0)
    half = equation("M⁻¹ Jᵀ y = 0", MI * J.T * y, 0)
    form = positivity(
        "J M⁻¹ Jᵀ is never negative",
        x.T * W * x,
        (Term(1, (), Square(MI * J.T * x, DEFINITE_MASS)),),
        (INVERSE_MASS,),
        "it is twice the kinetic energy of M⁻¹ Jᵀ x",
    )
    square = identity("the energy of M⁻¹ Jᵀ y is 0", half.lhs.T * M * half.lhs, 0, (INVERSE_MASS, zero, zero.T))
    end = identity(
        "y = 0",
        y,
        0,
        because="y = Kᵀ Jᵀ y = Kᵀ M (M⁻¹ Jᵀ y)",
        first=(
            Cofactor(right_inverse.T * M, half, ONE),
            Cofactor(-right_inverse.T, INVERSE_MASS, J.T * y),
            Cofactor(-ONE, independent.T, y),
        ),
    )
    return Statement(
        title="Independent rows make the Delassus matrix definite",
        source="paper (35)",
        statement=(
            r"If the rows of $J$ are independent ($J K = I$ for some $K$) and $M \succ 0$, then $x^\top J M^{-1} "
            r"J^\top x \geq 0$ for every $x$, and $y^\top J M^{-1} J^\top y = 0$ only for $y = 0$."
        ),
        given=(INVERSE_MASS, DEFINITE_MASS, independent, zero),
        steps=(form, square, Cancelling(half, square.claim, DEFINITE_MASS), end),
        concludes=(form.claim.name, end.claim.name),
        witness=DELASSUS_DEFINITE_CASE,
        needed=(
            Without(INVERSE_MASS.name, DELASSUS_DEFINITE_CASE.with_values(**{"M⁻¹": [[0]], "y": [1]})),
            Without(DEFINITE_MASS.name, NULL, "forces along (1, 1) do no work on masses 1 and −1"),
            Without(independent.name, DELASSUS_DEFINITE_CASE.with_values(J=[[0]], y=[1]), "a row of zeros"),
            Without(zero.name, DELASSUS_DEFINITE_CASE.with_values(y=[1])),
        ),
        twins=(
            Twin(
                "the bound would hold without the factor λ_min(M⁻¹)",
                NonNegative("xᵀ W x ≥ xᵀ J Jᵀ x", x.T * W * x - x.T * J * J.T * x),
                DELASSUS_DEFINITE_CASE.with_values(**{"M": [[2]], "M⁻¹": [["1/2"]]}),
            ),
        ),
        remarks=("(35) as printed ends in v vᵀ, a matrix; read vᵀ v.",),
    )
