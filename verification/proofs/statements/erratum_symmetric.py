"""Erratum: after (32) the paper concludes "symmetric, hence positive semi-definite"."""

from verification.proofs.algebra import matrix
from verification.proofs.exact import instance
from verification.proofs.facts import Definite, NonNegative, equation
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Square, Term


def statement() -> Statement:
    mass, x, form = matrix("D", "d", "d"), matrix("X", "d", "d"), matrix("S", "d", "d")
    name = equation("the matrix of the loss, with X = J̄ J", form, x.T * mass * x)
    definite = Definite("D is positive definite", mass)
    psd = positivity("S ⪰ 0", form, (Term(1, (), Square(x, definite)),), (name,), "a congruence of D")
    case = instance({"D": [[1]], "X": [[1]], "Y": [[-1]]})
    other = matrix("Y", "d", "d")
    return Statement(
        name="erratum_symmetric",
        title="Erratum: symmetric does not mean positive semi-definite",
        source="paper, Appendix I, the sentence after (32)",
        statement=(
            r"$S = (\bar J J)^\top D (\bar J J)$ is positive semi-definite because it is a congruence of $D "
            r"\succ 0$; the paper's reason, that it is symmetric, does not carry."
        ),
        given=(definite,),
        definitions=(name,),
        steps=(psd,),
        concludes=("S ⪰ 0",),
        witness=case,
        needed=(Without(definite.name, case.with_values(D=[[-1]])),),
        twins=(
            Twin(
                "the paper's reason: every symmetric matrix is positive semi-definite",
                NonNegative("Y + Yᵀ ⪰ 0", other + other.T),
                case,
            ),
        ),
    )
