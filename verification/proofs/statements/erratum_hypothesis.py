"""Erratum: the hypothesis of Theorem 2 is printed with q̇ where q̇₀ is meant."""

from verification.proofs.algebra import vector
from verification.proofs.exact import instance
from verification.proofs.facts import Nonzero, equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor, Dividing
from verification.proofs.vocabulary import ONE, J, e, v


def statement() -> Statement:
    after = vector("v⁺", "d")
    printed = equation("as printed: J q̇ = −e J q̇", J * after, -e * J * after)
    distinct = Nonzero("e is not −1", 1 + e)
    product = identity("(1 + e) J q̇ = 0", (1 + e) * J * after, 0, first=(Cofactor(ONE, printed, ONE),))
    stuck = Dividing(equation("every impact is plastic: J q̇ = 0", J * after, 0), product.claim, distinct)
    case = instance({"J": [[1]], "v⁺": [0], "v": [-1]}, e=1)
    return Statement(
        name="erratum_hypothesis",
        title="Erratum: the restitution law printed in Theorem 2",
        source="paper V-B, hypothesis of Theorem 2",
        statement=(
            r"Theorem 2 asks for $J_c \dot q = -e J_c \dot q$, with the same velocity on both sides. For $e "
            r"\neq -1$ that says $J_c \dot q = 0$: every impact would be plastic. Meant is (15), $J_c \dot "
            r"q = -e J_c \dot q_0$."
        ),
        given=(printed, distinct),
        steps=(product, stuck),
        concludes=(stuck.claim.name,),
        witness=case,
        needed=(
            Without(printed.name, case.with_values({"v⁺": [1]})),
            Without(distinct.name, case.with_values({"v⁺": [1]}, e=-1)),
        ),
        twins=(
            Twin(
                "the printed hypothesis is Newton's law (15)",
                equation("J q̇ = −e J q̇₀", J * after, -e * J * v),
                case,
                "an elastic ball that is stopped dead",
            ),
        ),
    )
