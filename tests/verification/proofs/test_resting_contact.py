"""Implicit resting contact: the statements hold on exact solutions of its law, and the explicit law breaks them."""

import itertools
import random
from fractions import Fraction

from verification.proofs import layout
from verification.proofs.cases import all_hold, completed, matrix_of, read_case
from verification.proofs.numbers import spring_energy_after
from verification.proofs.statement import Statement


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
    contact, energy = (Statement(layout.block(name)) for name in ("resting_contact", "resting_energy"))
    draw, pushing = random.Random(8), 0
    for _ in range(60):
        mass, h, start, c, s, t, b, gap = (Fraction(draw.randint(1, 9), draw.randint(1, 9)) for _ in range(8))
        start *= draw.choice((-4, 1))
        contacts = [(s, Fraction(0), gap - 1, Fraction(1)), (t, b, Fraction(draw.randint(-3, 2)), -c)]
        v, forces = solved(mass, start, h, contacts)
        a, after = [], []
        for (stiff, damp, gap, j), force in zip(contacts, forces, strict=True):
            n, n_after = max(-gap, Fraction(0)), max(-gap - h * j * v, Fraction(0))
            case = {name: matrix_of([[value]]) for name, value in {
                "K": stiff, "B": damp, "h": h, "φ": gap, "γ": j * v, "φ⁺": gap + h * j * v, "n": n, "n⁺": n_after,
                "f": force}.items()}
            assert all_hold((*contact.given, *contact.conclusions), completed(case, contact.definitions))
            a, after = [*a, stiff * n * n / 2], [*after, stiff * n_after * n_after / 2]
        case = read_case(f"M={mass} J=[1; {-c}] P=[{h * forces[0]} 0; 0 {h * forces[1]}] u=[1; 1] T=1 r=0 v*={start} "
                         f"v⁺={v} a=[{a[0]}; {a[1]}] b=[{after[0]}; {after[1]}]", energy.names)
        assert all_hold((*energy.given, *energy.conclusions), completed(case, energy.definitions))
        pushing += sum(force > 0 for force in forces)
    assert pushing > 30


def test_the_explicit_force_creates_energy_where_the_implicit_one_does_not() -> None:
    assert spring_energy_after(implicit=True) == Fraction(4, 9) and spring_energy_after(implicit=False) == 32
