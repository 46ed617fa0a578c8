"""Erratum: spreading an impulse over steps does not end at the prescribed velocity, unless e = 0."""

from fractions import Fraction

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import equation
from verification.proofs.rewriting import identity
from verification.proofs.statement import Statement, Twin
from verification.proofs.steps import Exact
from verification.proofs.vocabulary import e

MASS, SPEED, RESTITUTION, FORCE, STEP = (
    Fraction(2),
    Fraction(-1, 10),
    Fraction(1, 2),
    Fraction(15),
    Fraction(1, 512),
)


def spread(speed: Fraction) -> tuple[Fraction, int]:
    """Velocity at which spreading ends, and the steps it takes: Newton's law is restarted in each step."""
    steps = 0
    while speed < 0:
        wanted = -(1 + RESTITUTION) * MASS * speed
        impulse = min(wanted, FORCE * STEP)
        speed, steps = speed + impulse / MASS, steps + 1
        if impulse == wanted:
            break
    return speed, steps


def statement() -> Statement:
    start, factor, middle, end = (scalar(name) for name in ("v₀", "s", "v₁", "v₂"))
    names = (
        equation("first step, scaled by s", middle, (1 - factor * (1 + e)) * start),
        equation("last step, in full", end, -e * middle),
    )
    miss = identity("what is missing", end + e * start, e * (1 + e) * factor * start, names, "v₂ − (−e v₀)")
    speed, steps = spread(SPEED)
    return Statement(
        name="erratum_spreading",
        title="Erratum: spreading does not deliver the prescribed restitution",
        source="paper VI, third strategy; erratum 5",
        statement=(
            r"Scale the first impulse by $s$, then apply Newton's law again in full: the velocity ends at "
            r"$-e v_0 + e (1+e) s v_0$. The prescribed $-e v_0$ is reached only for $e = 0$ (or $s = 0$, $e "
            r"= -1$)."
        ),
        definitions=names,
        steps=(
            miss,
            Exact(
                "steps taken: m = 2 kg, v = −0.1 m/s, e = 1/2, 15 N, 512 Hz",
                Fraction(steps),
                "=",
                Fraction(7),
            ),
            Exact("velocity reached [m/s], instead of 0.05", speed, "<", Fraction(26, 10000)),
        ),
        concludes=(miss.claim.name,),
        twins=(
            Twin(
                "as the paper says: the prescribed velocity is reached",
                equation("v₂ = −e v₀", end, -e * start),
                instance({"v₀": -1, "s": "1/2"}, e="1/2"),
            ),
            Twin("the numbers above", Exact("velocity reached", speed, "=", Fraction(1, 20))),
        ),
        remarks=("The remedy is to remember the target: apply what is missing to −e v₀ in each step.",),
    )
