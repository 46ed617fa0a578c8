"""Erratum: Appendix III gives the left-over rows full rank."""

from fractions import Fraction

from verification.proofs.linear import rank
from verification.proofs.statement import Statement, Twin
from verification.proofs.steps import Exact


def statement() -> Statement:
    rows = [[1], [1], [1]]
    all_rows, left_over = Fraction(rank(rows)), Fraction(rank(rows[1:]))
    return Statement(
        name="erratum_rank",
        title="Erratum: the rank of the rows left over",
        source="paper, Appendix III, before (36)",
        statement=(
            r"The paper splits $J_c$ into $J_n$ of rank $n$ and $J_r$ of $r$ rows and says $rank(J_r) = r$. "
            r"One wall reported three times has $n = 1$, $r = 2$ and $rank(J_r) = 1$. Nothing in the proof "
            r"uses the claim."
        ),
        steps=(
            Exact("the rank of all three rows, so n = 1", all_rows, "=", Fraction(1)),
            Exact("the rank of the two rows left over", left_over, "=", Fraction(1)),
        ),
        twins=(Twin("as printed", Exact("rank(J_r) = r", left_over, "=", Fraction(2))),),
    )
