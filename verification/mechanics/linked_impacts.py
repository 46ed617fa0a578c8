"""Newton's cradle and Bernoulli's three balls: the outcome depends on the rows, not only on energy
and momentum.

The engine's map (21) resolves the same elastic impact with different sets of rows; the exact
event-driven reference resolves it one contact after the other. With relative rows (12) all these
outcomes conserve energy and momentum. The paper's per-body rows (13)-(14) conserve energy but not
momentum (erratum 3).

    cradle     n balls in a line: the first arrives with v = 1 m/s, the others rest and touch
    Bernoulli  a ball arrives along x between two touching balls, whose centres are at ±30°
               from its path
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

from iapb import resolve_impact
from reference import Floats
from reference.event_driven import LinearSystem, event_driven
from verification.check import Check, Study
from verification.finding import REFUTED, REPRODUCED, Part
from verification.table import Row, Table

# Initial gaps that order the contacts for the event-driven reference; its gaps change linearly, so
# any size works.
_GAP = 1e-3
# Largest relative change of energy or momentum due to rounding: some thousand roundings of numbers
# of order one.
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

    def __str__(self) -> str:
        return self.name

    def per_body_rows(self, chosen: Sequence[int]) -> Floats:
        """Rows (13) and (14), nᵀJ_a and nᵀJ_b, of the chosen contacts."""
        rows = np.zeros((len(chosen), 2, *self.velocity.shape))
        for row, contact in zip(rows, chosen, strict=True):
            a, b = self.contacts[contact]
            row[0, a] = row[1, b] = self.normals[contact]
        return rows.reshape(2 * len(chosen), -1)

    def relative_rows(self, chosen: Sequence[int]) -> Floats:
        """Rows (12), nᵀ(J_a − J_b), of the chosen contacts."""
        rows = self.per_body_rows(chosen)
        return rows[::2] - rows[1::2]

    def approaching(self) -> tuple[int, ...]:
        """Indices of the contacts with v_n < 0."""
        every = range(len(self.contacts))
        return tuple(
            np.flatnonzero(self.relative_rows(every) @ self.velocity.ravel() < 0.0).tolist()
        )


def cradle(balls: int = 5) -> LinkedBalls:
    """Newton's cradle: ball 0 arrives along +x."""
    velocity = np.zeros((balls, 2))
    velocity[0, 0] = 1.0
    contacts = tuple((k, k + 1) for k in range(balls - 1))
    return LinkedBalls(
        f"cradle of {balls}", contacts, np.tile([-1.0, 0.0], (balls - 1, 1)), velocity
    )


def bernoulli(degrees: float = 30.0) -> LinkedBalls:
    """Bernoulli's three balls: ball 0 arrives along +x; balls 1 and 2 lie at ±`degrees` and touch
    each other at 30°."""
    angle = math.radians(degrees)
    normals = np.array(
        [[-math.cos(angle), -math.sin(angle)], [-math.cos(angle), math.sin(angle)], [0.0, 1.0]]
    )
    velocity = np.zeros((3, 2))
    velocity[0, 0] = 1.0
    return LinkedBalls("Bernoulli", ((0, 1), (0, 2), (1, 2)), normals, velocity)


def outcomes(balls: LinkedBalls) -> Iterator[tuple[str, str, Floats]]:
    """Yield treatment, rows or order in words, and velocity (n, 2) after the elastic impact
    [m/s]."""
    chosen = {ALL: tuple(range(len(balls.contacts))), APPROACHING: balls.approaching()}
    v = balls.velocity.ravel()
    for treatment, rows in ((RELATIVE, balls.relative_rows), (PER_BODY, balls.per_body_rows)):
        for words, contacts in chosen.items():
            after = resolve_impact(np.eye(len(v)), rows(contacts), v, 1.0).velocity
            yield treatment, words, after.reshape(-1, 2)
    for order, start in _orders(balls):
        system = LinearSystem(
            np.eye(len(v)), np.zeros(len(v)), balls.relative_rows(chosen[ALL]), start, 1.0
        )
        path = event_driven(system, np.zeros(len(v)), v, duration=10.0)
        yield SEQUENTIAL, order, path.v[-1].reshape(-1, 2)


def _orders(balls: LinkedBalls) -> Iterator[tuple[str, Floats]]:
    """Yield orders and their initial gaps: all contacts at once, then each order in which they may
    close."""
    c = len(balls.contacts)
    yield "all at once, Newton's LCP", np.zeros(c)
    if balls.name.startswith("cradle"):
        yield "one after the other along the row", np.linspace(0.0, _GAP * (c - 1), c)
        return
    for order in permutations(balls.approaching()):
        start = np.zeros(c)
        start[list(order)] = _GAP * np.arange(len(order))
        yield "contact " + ", then ".join(map(str, order)), start


def _rows(_: Study, balls: LinkedBalls) -> Iterator[Row]:
    """Yield a row per ball of each outcome, with the relative changes of kinetic energy and
    momentum."""
    before, total = balls.velocity, balls.velocity.sum(axis=0)
    for treatment, words, velocity in outcomes(balls):
        energy = float(np.sum(velocity**2) / np.sum(before**2) - 1.0)
        momentum = float(np.linalg.norm(velocity.sum(axis=0) - total) / np.linalg.norm(total))
        for ball, after in enumerate(velocity):
            yield {
                "problem": balls.name,
                "treatment": treatment,
                "rows or order": words,
                "ball": ball,
                "v_x before [m/s]": float(before[ball, 0]),
                "v_x after [m/s]": float(after[0]),
                "v_y after [m/s]": float(after[1]),
                "energy change": energy,
                "momentum change": momentum,
            }


def findings(table: Table) -> Iterator[Part]:
    """Yield the parts on conservation, on erratum 3, and on the choice of rows."""
    relative = table.only(treatment != PER_BODY for treatment in table["treatment"])
    energy, momentum = max(map(abs, relative["energy change"])), max(relative["momentum change"])
    yield Part.of(
        "Newton's cradles of 2 to 7 balls, and a ball that strikes two touching ones (Bernoulli), "
        "with relative rows "
        "(12), solved all at once or one contact after the other",
        f"energy changes by at most {energy:.1e} of its value, momentum by at most {momentum:.1e}",
        f"at most {CONSERVED:g}",
        REPRODUCED if max(energy, momentum) <= CONSERVED else REFUTED,
    )
    per_body = table.where(treatment=PER_BODY)
    energy, least = max(map(abs, per_body["energy change"])), min(per_body["momentum change"])
    yield Part.of(
        "The same balls with the paper's per-body rows (13)-(14)",
        f"energy changes by at most {energy:.1e} of its value. Momentum always changes by at "
        f"least {least:.2g} times "
        "its value: the striking ball rebounds as from a wall",
        "momentum changes (number 3 of our errata)",
        REPRODUCED if energy <= CONSERVED < least else REFUTED,
    )
    if five := table.where(problem="cradle of 5").records():
        yield _rows_decide(five)


def _rows_decide(five: Sequence[Row]) -> Part:
    """Return the part on the cradle of five: three choices of rows conserve energy and momentum,
    but differ."""
    choices = {
        "rows of all touching contacts": (RELATIVE, ALL),
        "row of the approaching one": (RELATIVE, APPROACHING),
        "one contact after the other": (SEQUENTIAL, "one after the other along the row"),
    }
    after = {
        name: np.array(
            [row["v_x after"] for row in five if (row["treatment"], row["rows or order"]) == choice]
        )
        for name, choice in choices.items()
    }
    words = "; ".join(
        f"{name} ({', '.join(f'{round(v, 1) + 0.0:.1f}' for v in values)})"
        for name, values in after.items()
    )
    apart = min(float(np.abs(a - b).max()) for a, b in combinations(after.values(), 2))
    return Part.of(
        "Conservation laws do not determine the outcome; the choice of contacts that enter the impact does",
        f"velocities [m/s] of a cradle of five balls after the impact: {words}. The paper uses "
        f"the contacts that "
        "approach. Only one contact after the other gives the last ball all momentum",
        "outcomes that differ",
        REPRODUCED if apart > CONSERVED else REFUTED,
    )


LINKED_IMPACTS = Check(
    key="linked impacts",
    question="What do touching balls do in an elastic impact?",
    cases=lambda _: (*(cradle(n) for n in range(2, 8)), bernoulli()),
    row=_rows,
    says=findings,
    note="Elastic impacts of equal frictionless balls; the order names the contacts that close first. Changes are "
    "relative to the energy or momentum before.",
)
