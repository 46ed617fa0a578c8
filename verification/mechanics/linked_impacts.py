"""Newton's cradle and Bernoulli's three balls: the outcome depends on the rows, not only on energy and momentum.

The engine's map (21) resolves the same elastic impact with different sets of rows; the exact event-driven reference
resolves it one contact after the other. With relative rows (12) all these outcomes conserve energy and momentum. The
paper's per-body rows (13)-(14) conserve energy but not momentum (erratum 3).

    cradle     n balls in a line: the first arrives with v = 1 m/s, the others rest and touch
    Bernoulli  a ball arrives along x between two touching balls, whose centres are at ±30° from its path
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from iapb import resolve_impact
from reference.event_driven import LinearSystem, event_driven
from verification.finding import REFUTED, REPRODUCED, Failure, Part, Table, of_each, titled

Floats = NDArray[np.float64]

# Initial gaps that order the contacts for the event-driven reference; its gaps change linearly, so any size works.
_GAP = 1e-3
# Largest relative change of energy or momentum due to rounding: some thousand roundings of numbers of order one.
CONSERVED = 1e-12
RELATIVE, PER_BODY = "simultaneous, relative rows (12)", "simultaneous, per-body rows (13)-(14)"
SEQUENTIAL = "event-driven"
ALL, APPROACHING = "all touching contacts", "approaching contacts"


@dataclass(frozen=True)
class LinkedBalls:
    """Equal frictionless discs of 1 kg that touch; d = 2 n velocities (x, y of each disc).

    contacts : pairs (a, b) whose normal points from b to a; normals : (c, 2)
    velocity : (n, 2) before the impact [m/s]
    """

    name: str
    contacts: tuple[tuple[int, int], ...]
    normals: Floats
    velocity: Floats

    def relative_rows(self, chosen: Sequence[int]) -> Floats:
        """Rows (12), nᵀ(J_a − J_b), of the chosen contacts."""
        rows = np.zeros((len(chosen), *self.velocity.shape))
        for row, contact in zip(rows, chosen, strict=True):
            a, b = self.contacts[contact]
            row[a], row[b] = self.normals[contact], -self.normals[contact]
        return rows.reshape(len(chosen), -1)

    def per_body_rows(self, chosen: Sequence[int]) -> Floats:
        """Rows (13) and (14), nᵀJ_a and nᵀJ_b, of the chosen contacts."""
        rows = np.zeros((2 * len(chosen), *self.velocity.shape))
        for k, contact in enumerate(chosen):
            a, b = self.contacts[contact]
            rows[2 * k, a], rows[2 * k + 1, b] = self.normals[contact], self.normals[contact]
        return rows.reshape(2 * len(chosen), -1)

    def approaching(self) -> tuple[int, ...]:
        """Indices of the contacts with v_n < 0."""
        every = range(len(self.contacts))
        return tuple(np.flatnonzero(self.relative_rows(every) @ self.velocity.ravel() < 0.0).tolist())


@dataclass(frozen=True)
class LinkedOutcome:
    """Outcome of one treatment of one problem.

    rows : the rows or the order, in words; before, velocity : (n, 2) before and after the impact [m/s]
    """

    problem: str
    treatment: str
    rows: str
    before: Floats
    velocity: Floats

    @property
    def energy_change(self) -> float:
        """Relative change of the kinetic energy."""
        return float(np.sum(self.velocity**2) / np.sum(self.before**2) - 1.0)

    @property
    def momentum_change(self) -> float:
        """Magnitude of the change of momentum, relative to the momentum before."""
        before = self.before.sum(axis=0)
        return float(np.linalg.norm(self.velocity.sum(axis=0) - before) / np.linalg.norm(before))


def cradle(balls: int = 5) -> LinkedBalls:
    """Newton's cradle: ball 0 arrives along +x."""
    velocity = np.zeros((balls, 2))
    velocity[0, 0] = 1.0
    contacts = tuple((k, k + 1) for k in range(balls - 1))
    return LinkedBalls(f"cradle of {balls}", contacts, np.tile([-1.0, 0.0], (balls - 1, 1)), velocity)


def bernoulli(degrees: float = 30.0) -> LinkedBalls:
    """Bernoulli's three balls: ball 0 arrives along +x; balls 1 and 2 lie at ±`degrees` and touch each other at 30°."""
    angle = math.radians(degrees)
    normals = np.array([[-math.cos(angle), -math.sin(angle)], [-math.cos(angle), math.sin(angle)], [0.0, 1.0]])
    velocity = np.zeros((3, 2))
    velocity[0, 0] = 1.0
    return LinkedBalls("Bernoulli", ((0, 1), (0, 2), (1, 2)), normals, velocity)


def outcomes(balls: LinkedBalls) -> tuple[LinkedOutcome, ...]:
    """Return the elastic outcomes of every treatment."""
    chosen = {ALL: tuple(range(len(balls.contacts))), APPROACHING: balls.approaching()}
    rows_of = {RELATIVE: balls.relative_rows, PER_BODY: balls.per_body_rows}
    found = [_mapped(balls, treatment, words, rows(contacts))
             for treatment, rows in rows_of.items() for words, contacts in chosen.items()]  # fmt: skip
    return (*found, *_sequential(balls))


def _mapped(balls: LinkedBalls, treatment: str, rows_in_words: str, rows: Floats) -> LinkedOutcome:
    v = balls.velocity.ravel()
    after = resolve_impact(np.eye(len(v)), rows, v, 1.0).velocity
    return LinkedOutcome(balls.name, treatment, rows_in_words, balls.velocity, after.reshape(-1, 2))


def _sequential(balls: LinkedBalls) -> Iterator[LinkedOutcome]:
    """Yield event-driven outcomes: all contacts at once by Newton's LCP, then each order in which they may close."""
    c = len(balls.contacts)
    yield _event_driven(balls, "all at once, Newton's LCP", np.zeros(c))
    if balls.name.startswith("cradle"):
        yield _event_driven(balls, "one after the other along the row", np.linspace(0.0, _GAP * (c - 1), c))
        return
    for order in permutations(balls.approaching()):
        start = np.zeros(c)
        for rank, contact in enumerate(order):
            start[contact] = _GAP * rank
        yield _event_driven(balls, "contact " + ", then ".join(str(k) for k in order), start)


def _event_driven(balls: LinkedBalls, order: str, start: Floats) -> LinkedOutcome:
    d = balls.velocity.size
    rows = balls.relative_rows(range(len(balls.contacts)))
    system = LinearSystem(np.eye(d), np.zeros(d), rows, start, 1.0)
    path = event_driven(system, np.zeros(d), balls.velocity.ravel(), duration=10.0)
    return LinkedOutcome(balls.name, SEQUENTIAL, order, balls.velocity, path.v[-1].reshape(-1, 2))


def study_linked_impacts(failures: list[Failure] | None = None) -> tuple[LinkedOutcome, ...]:
    """Return all outcomes: cradles of two to seven balls, and Bernoulli's problem."""
    problems = [*(cradle(n) for n in range(2, 8)), bernoulli()]
    return tuple(of_each(problems, outcomes, failures, lambda balls: balls.name))


def linked_table(found: Sequence[LinkedOutcome]) -> Table:
    """Return a table with one row per ball of each outcome."""
    columns = ("problem", "treatment", "rows or order", "ball", "v_x before [m/s]", "v_x after [m/s]",
               "v_y after [m/s]", "energy change", "momentum change")  # fmt: skip
    rows = [
        (o.problem, o.treatment, o.rows, ball, float(o.before[ball, 0]), float(after[0]), float(after[1]),
         o.energy_change, o.momentum_change)
        for o in found for ball, after in enumerate(o.velocity)
    ]  # fmt: skip
    note = "Elastic impacts of equal frictionless balls; changes are relative to what there was before."
    return titled(columns, rows, note=note)


def _changes(found: Sequence[LinkedOutcome]) -> tuple[float, float]:
    """Return the largest change of energy and of momentum."""
    return max(abs(o.energy_change) for o in found), max(o.momentum_change for o in found)


def conserved(found: Sequence[LinkedOutcome]) -> Part:
    """Return the part on relative rows and sequences: their changes of energy and momentum."""
    energy, momentum = _changes([o for o in found if o.treatment != PER_BODY])
    return Part(
        f"Newton's cradles of 2 to 7 balls and Bernoulli's three balls ({len({o.problem for o in found})} problems): "
        f"with relative rows (12), solved at once or event by event, energy changes by at most {energy:.1e} and "
        f"momentum by at most {momentum:.1e} (tolerance {CONSERVED:g}).",
        REPRODUCED if max(energy, momentum) <= CONSERVED else REFUTED)  # fmt: skip


def per_body(found: Sequence[LinkedOutcome]) -> Part:
    """Return the part on erratum 3: the change of momentum with the paper's per-body rows."""
    lost = [o for o in found if o.treatment == PER_BODY]
    energy, least = _changes(lost)[0], min(o.momentum_change for o in lost)
    return Part(
        f"With the per-body rows (13)-(14) energy changes by at most {energy:.1e}, but momentum changes by at least "
        f"{least:.2g} times its value in all {len(lost)} cases: the striking ball rebounds as from a wall (erratum 3).",
        REPRODUCED if energy <= CONSERVED < least else REFUTED)  # fmt: skip


def rows_decide(found: Sequence[LinkedOutcome]) -> Part:
    """Return the part on the cradle of five: three choices of rows conserve energy and momentum, but differ."""
    five = {(o.treatment, o.rows): o.velocity[:, 0] for o in found if o.problem == "cradle of 5"}
    after = {"all touching rows": five[RELATIVE, ALL], "the approaching row": five[RELATIVE, APPROACHING],
             "one after the other": next(v for (_, rows), v in five.items() if "one after" in rows)}  # fmt: skip
    words = "; ".join(f"{name} ({', '.join(f'{v + 0.0:.1f}' for v in values)})" for name, values in after.items())
    apart = min(float(np.abs(a - b).max()) for a, b in combinations(after.values(), 2))
    return Part(
        "Conservation laws do not determine the outcome; it depends on which contacts enter the collision. Velocities "
        f"of five balls after the impact: {words} m/s. The paper uses the contacts that approach. Only solving the "
        "contacts one after the other passes the impulse to the last ball.",
        REPRODUCED if apart > CONSERVED else REFUTED)  # fmt: skip


def linked_in_short(found: Sequence[LinkedOutcome]) -> str:
    """Return the sentence for the first page."""
    kept = max(_changes([o for o in found if o.treatment != PER_BODY]))
    least = min(o.momentum_change for o in found if o.treatment == PER_BODY)
    return (f"Impacts between touching balls conserve energy and momentum to {kept:.1e} with relative rows (12), while "
            f"the paper's per-body rows (13)-(14) change the total momentum by at least {least:.2g} times its value")
