"""Erratum: per-body rows (13)-(14) make the outcome depend on the observer."""

from verification.proofs.algebra import vector
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.vocabulary import MI, G, J, e, v

BALLS = instance({"M⁻¹": [[1, 0], [0, 1]], "J": [[-1, 1]], "G": [["1/2"]], "v": [1, 0], "t": [1, 1]}, e=1)


def statement() -> Statement:
    shift, after, moved = vector("t", "d"), vector("v⁺", "d"), vector("w⁺", "d")
    names = (
        equation("the impact", after, v - (1 + e) * MI * J.T * G * J * v),
        equation(
            "the impact seen from a moving frame",
            moved,
            (v + shift) - (1 + e) * MI * J.T * G * J * (v + shift),
        ),
    )
    rigid = equation("moving all bodies together opens no contact: J t = 0", J * shift, 0)
    same = identity("both observers agree: w⁺ = v⁺ + t", moved, after + shift, (*names, rigid))
    own_rows = BALLS.with_values({"J": [[-1, 0], [0, 1]], "G": [[1, 0], [0, 1]]})
    return Statement(
        name="erratum_self_collision",
        title="Erratum: per-body rows depend on the observer",
        source="paper (13)-(14), assumption (ii); erratum 3",
        statement=(
            r"With relative rows (12) a common velocity $t$ of all bodies has $J t = 0$, and adding it "
            r"before the impact adds it after. With the per-body rows (13)-(14) it does not."
        ),
        given=(rigid,),
        definitions=names,
        steps=(same,),
        concludes=(same.claim.name,),
        witness=BALLS,
        needed=(
            Without(
                rigid.name,
                own_rows,
                "a ball that hits an equal one at rest bounces back at −1 and leaves it at rest; seen from "
                "a frame that moves along, both bounce at −2 and −1",
            ),
        ),
        twins=(Twin("a common velocity changes nothing", equation("w⁺ = v⁺", moved, after), BALLS),),
        remarks=(
            "The reason given for (13)-(14), passivity, does not ask for them: theorem_2 holds for every "
            "J. That they also break conservation of momentum is in the file momentum.",
        ),
    )
