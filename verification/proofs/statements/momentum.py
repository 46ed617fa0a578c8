"""Relative rows conserve momentum; the paper's per-body rows (13)-(14) do not."""

from verification.proofs.algebra import vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Cofactor
from verification.proofs.vocabulary import ONE, J, M, v

# two unit balls on a line; ball 1 moves at 1 into ball 2 at rest; relative row (−1, 1), elastic
BALLS = instance({"M": [[1, 0], [0, 1]], "J": [[-1, 1]], "p": [1], "v": [1, 0], "v⁺": [0, 1], "t": [1, 1]})


def statement() -> Statement:
    motion, p, after = vector("t", "d"), vector("p", "c"), vector("v⁺", "d")
    balance = equation("momentum balance (9)", M * after, M * v + J.T * p)
    rigid = equation("moving all bodies together opens no contact: J t = 0", J * motion, 0)
    kept = identity(
        "momentum along t is conserved",
        motion.T * M * after,
        motion.T * M * v,
        (rigid.T,),
        "tᵀ M v⁺ − tᵀ M v = (J t)ᵀ p",
        first=(Cofactor(motion.T, balance, ONE),),
    )
    own_rows = BALLS.with_values({"J": [[-1, 0], [0, 1]], "p": [2, 0], "v⁺": [-1, 0]})
    return Statement(
        name="momentum",
        title="Relative rows conserve momentum",
        source="paper (12) against (13)-(14); erratum 3; Newton's third law",
        statement=(
            r"Let $t$ be a motion of all bodies together (a translation or rotation), so that $J t = 0$ for "
            r"relative rows. Then $t^\top M v^+ = t^\top M v$ for every impulse $p$."
        ),
        given=(balance, rigid),
        steps=(kept,),
        concludes=(kept.claim.name,),
        witness=BALLS,
        needed=(
            Without(balance.name, BALLS.with_values({"v⁺": [0, 2]})),
            Without(rigid.name, own_rows, "(13)-(14): ball 1 bounces back from a free ball as from a wall"),
        ),
        twins=(
            Twin(
                "the momentum of each body is conserved",
                equation("M v⁺ = M v", M * after, M * v),
                BALLS,
            ),
        ),
    )
