"""Erratum: (32) carries the factor ½ to its last line and drops it there."""

from fractions import Fraction

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin
from verification.proofs.vocabulary import e


def statement() -> Statement:
    energy, form = scalar("k"), scalar("x")
    before = energy - (1 + e) * Fraction(1, 2) * (2 * form - (1 + e) * form)
    step = identity("the last step of (32)", before, energy - Fraction(1, 2) * (1 - e * e) * form)
    return Statement(
        name="erratum_half",
        title="Erratum: the half that (18), (24) and (32) lose",
        source="paper (32), last line; (18), (24); erratum 1",
        statement=(
            r"With $k = KE_0$ and $x = \dot q_0^\top J^\top \bar J^\top D \bar J J \dot q_0$ the last but "
            r"one line of (32) is $k - (1+e) \frac12 (2 x - (1+e) x)$, which equals $k - \frac12 (1-e^2) x$ "
            r"and not $k - (1-e^2) x$."
        ),
        steps=(step,),
        concludes=(step.claim.name,),
        twins=(
            Twin(
                "the last line as printed",
                equation("(32)", before, energy - (1 - e * e) * form),
                instance(k="1/2", x=1, e=0),
                "m = 1, v = −1, plastic: printed, the energy after the impact would be −1/2",
            ),
        ),
    )
