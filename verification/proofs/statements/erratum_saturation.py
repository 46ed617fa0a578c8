"""Erratum: clipping the device's force component by component can add energy to the device."""

from fractions import Fraction

from verification.proofs.algebra import scalar
from verification.proofs.exact import instance
from verification.proofs.facts import NonNegative, equation
from verification.proofs.rewriting import positivity
from verification.proofs.statement import Statement, Twin, Without
from verification.proofs.steps import Exact, Term

LIMIT_FORCE, LIMIT_TORQUE = Fraction(15, 512), Fraction(1, 512)  # 15 N and 1 N m over one step of 1/512 s


def statement() -> Statement:
    f, speed, inverse_mass, factor, gain = (scalar(name) for name in ("f", "v", "ω", "s", "Δ"))
    name = equation(
        "twice the gain of one component of a diagonal inertia", gain, _gain(factor, f, speed, inverse_mass)
    )
    low, high = NonNegative("s ≥ 0", factor), NonNegative("s ≤ 1", 1 - factor)
    mass = NonNegative("ω = 1/m ≥ 0", inverse_mass)
    alone = NonNegative("unclipped, this component loses by itself", -_gain(1, f, speed, inverse_mass))
    passive = positivity(
        "clipped, it loses too",
        -gain,
        (Term(1, (low, alone)), Term(1, (low, high, mass, NonNegative("f² ≥ 0", f * f)))),
        (name,),
    )
    square = positivity("f² ≥ 0", f * f, (_square(f),))
    case = instance(f=1, v=-1, ω=1, s="1/2")
    return Statement(
        name="erratum_saturation",
        title="Erratum: saturating component by component can add energy",
        source="paper VI, first strategy; erratum 5",
        statement=(
            r"For a diagonal inertia, clipping component $i$ of the impulse is harmless when that component "
            r"loses energy by itself. An impact only promises that the sum loses: with one component "
            r"clipped the other may win."
        ),
        given=(low, high, mass, alone),
        definitions=(name,),
        steps=(square, passive, *_peg()[0]),
        concludes=(passive.claim.name,),
        witness=case,
        needed=(
            Without(low.name, case.with_values(s=-1)),
            Without(high.name, case.with_values(s=3)),
            Without(mass.name, case.with_values(f=1, v=-1, ω=-4, s="1/2").with_values(v=1, ω=-2, s="1/2")),
            Without(alone.name, case.with_values(v=1)),
        ),
        twins=(Twin("saturation is passive: the peg struck at its corner", _peg()[1]),),
        remarks=(
            "The peg (2 kg, 0.005 kg m²) meets a wall with the arm 0.01 m, moving at −0.1 m/s and turning "
            "away at 4 rad/s, e = 0. The limits are the paper's, 15 N and 1 N m for one step at 512 Hz.",
        ),
    )


def _gain(factor, f, speed, inverse_mass):  # type: ignore[no-untyped-def]
    return 2 * factor * f * speed + factor * factor * f * f * inverse_mass


def _square(f):  # type: ignore[no-untyped-def]
    from verification.proofs.steps import Square

    return Term(1, (), Square(f))


def _peg() -> tuple[tuple[Exact, ...], Exact]:
    """Energies of the peg: full impulse, and clipped as the device would clip it."""
    mass, inertia, arm = Fraction(2), Fraction(1, 200), Fraction(1, 100)
    speed, spin = Fraction(-1, 10), Fraction(4)
    p = -(speed + arm * spin) / (1 / mass + arm**2 / inertia)
    force, torque = min(p, LIMIT_FORCE), min(arm * p, LIMIT_TORQUE)

    def gained(force: Fraction, torque: Fraction) -> Fraction:
        return force * speed + force**2 / (2 * mass) + torque * spin + torque**2 / (2 * inertia)

    zero = Fraction(0)
    steps = (
        Exact("the full impulse takes energy [J]", gained(p, arm * p), "<", zero),
        Exact("the force is clipped [N s]", p, ">", LIMIT_FORCE),
        Exact("the torque is not [N m s]", arm * p, "<", LIMIT_TORQUE),
        Exact("the clipped one adds energy [J]", gained(force, torque), ">", zero),
    )
    return steps, Exact("energy added by the clipped impulse [J]", gained(force, torque), "≤", zero)
