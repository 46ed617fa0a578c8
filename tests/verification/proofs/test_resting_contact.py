"""Implicit resting contact: the theorem holds on exact solutions of its law, and corrupted versions are refused."""

import itertools
import random
from dataclasses import replace
from fractions import Fraction

import pytest

from verification.proofs import load
from verification.proofs.algebra import NonNegative, scalar
from verification.proofs.checking import checked
from verification.proofs.exact import all_hold, completed, instance
from verification.proofs.statement import Statement
from verification.proofs.statements.resting_contact import EXPLICIT, IMPLICIT
from verification.proofs.steps import Dominating, Known, Refused


def solved(mass: Fraction, start: Fraction, h: Fraction, contacts: list[tuple[Fraction, ...]]) -> tuple[Fraction, list]:
    """v⁺ of one mass and the forces of its contacts (K, B, φ, j): the set of pushing contacts that is consistent."""
    for on in itertools.product((0, 1), repeat=len(contacts)):
        pushing = [one for one, pushes in zip(contacts, on, strict=True) if pushes]
        v = (mass * start - h * sum(j * s * gap for s, _, gap, j in pushing)) / (
            mass + h * sum(j * j * (s * h + b) for s, b, _, j in pushing))
        forces = [-s * gap - (s * h + b) * j * v for s, b, gap, j in contacts]
        if all((force > 0) == pushes for force, pushes in zip(forces, on, strict=True)):
            return v, [max(force, Fraction(0)) for force in forces]
    raise ValueError("the law has exactly one solution")


def test_both_statements_hold_on_the_exact_solution_of_two_contacts() -> None:
    draw, contact, energy, pushing = random.Random(8), load("resting_contact"), load("resting_energy"), 0
    for _ in range(60):
        mass, h, start, c, s, t, b, gap = (Fraction(draw.randint(1, 9), draw.randint(1, 9)) for _ in range(8))
        start *= draw.choice((-4, 1))
        contacts = [(s, Fraction(0), gap - 1, Fraction(1)), (t, b, Fraction(draw.randint(-3, 2)), -c)]
        v, forces = solved(mass, start, h, contacts)
        a, after = [], []
        for (stiff, damp, gap, j), force in zip(contacts, forces, strict=True):
            n, n_after = max(-gap, Fraction(0)), max(-gap - h * j * v, Fraction(0))
            case = instance({"K": stiff, "B": damp, "h": h, "φ": gap, "γ": j * v, "φ⁺": gap + h * j * v, "n": n,
                             "n⁺": n_after, "f": force})
            assert all_hold((*contact.given, *contact.conclusions), completed(case, contact.definitions))
            a, after = [*a, stiff * n * n / 2], [*after, stiff * n_after * n_after / 2]
        case = instance({"M": [[mass]], "J": [[1], [-c]], "P": [[h * forces[0], 0], [0, h * forces[1]]], "u": [1, 1],
                         "T": [[1]], "r": [0], "v*": [start], "v⁺": [v], "a": a, "b": after})
        assert all_hold((*energy.given, *energy.conclusions), completed(case, energy.definitions))
        pushing += sum(force > 0 for force in forces)
    assert pushing > 30


def corruptions() -> dict[str, Statement]:
    """Statements that differ in a sign, a factor, a hypothesis or a fact that nobody established."""
    one, bodies = load("resting_contact"), load("resting_energy")
    (factor, product, _, passive, _), (gain, with_friction, last) = one.steps, bodies.steps
    stiff, damp, h, f, speed = (scalar(name) for name in ("K", "B", "h", "f", "γ"))
    twice_the_work = replace(passive.claim, value=passive.claim.value - 2 * h * f * speed)
    pulling = replace(one.given[4], value=one.given[4].value - 2 * f)
    return {
        "k = K h − B": replace(one, definitions=(replace(one.definitions[0], rhs=stiff * h - damp),)),
        "f ≥ K φ + k γ": replace(one, given=(*one.given[:4], pulling, *one.given[5:])),
        "twice the work": replace(one, steps=(*one.steps[:3], replace(passive, claim=twice_the_work))),
        "no B ≥ 0": replace(one, given=tuple(fact for fact in one.given if fact.name != "B ≥ 0")),
        "nothing about the damper": replace(one, steps=(factor, product, passive)),
        "half of the gain": replace(bodies, steps=(
            replace(gain, claim=replace(gain.claim, rhs=gain.claim.rhs * Fraction(1, 2))), with_friction, last)),
        "friction not bounded": replace(bodies, steps=(gain, with_friction, replace(last, terms=last.terms[:1]))),
    }


@pytest.mark.parametrize("name", corruptions())
def test_a_corrupted_version_is_refused(name: str) -> None:
    record = checked(corruptions()[name])
    assert record.verdict == "not proved" and any(not step.accepted for step in record.steps)


def test_the_rule_for_the_damper_needs_its_factor_and_its_product() -> None:
    x, q = scalar("x"), scalar("q")
    factor, claim = NonNegative("q ≥ 0", q), NonNegative("x ≥ 0", x)
    product = NonNegative("q x ≥ x²", q * x - x * x)
    Dominating(claim, factor, product).verify(Known((factor, product)))
    weak = NonNegative("q x ≥ 0", q * x)
    for facts, used in (((product,), product), ((factor,), product), ((factor, weak), weak)):
        with pytest.raises(Refused):
            Dominating(claim, factor, used).verify(Known(facts))


def test_the_explicit_force_creates_energy_where_the_implicit_one_does_not() -> None:
    assert IMPLICIT.is_true and IMPLICIT.left == Fraction(4, 9)
    assert not EXPLICIT.claim.is_true and EXPLICIT.claim.left == 32 and EXPLICIT.claim.right == 4
