"""Operating a linkage: a hand holds any link at any point and leads the arm through its singular poses.

A spring and a damper connect the hand to a target that moves along a path at a given speed; the force acts on the arm
through `Simulation.step(hand_force=...)`. The compiled step uses only J_h^T, never its inverse, so it stays finite if
J_h loses rank. The force is constant over a step, so its work on the arm is exactly F . dx, and the residual of the
energy balance is the error of the integrator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import IapbError
from iapb.scene import Scene
from iapb.simulation import Simulation
from reference import Floats
from verification.check import Check, Study
from verification.table import Row, Table

SCENE = "held_arm"
LENGTHS = {"upper_arm": 0.3, "forearm": 0.25, "hand_link": 0.15}  # [m] of the scene's links
STIFFNESS, DAMPING = 400.0, 30.0  # of the hand [N/m, N s/m]
AFTER = 0.3  # [s] for which the hand stays at the end of its path
HOLDS = {"quick": (0.5, 1.0), "full": (0.2, 0.5, 0.8, 1.0)}  # fractions of the held link
SPEEDS = {"quick": (0.5, 4.0), "full": (0.1, 0.5, 1.0, 4.0, 8.0)}  # [m/s]
RATES = {"quick": (1000.0,), "full": (1000.0, 2000.0, 4000.0)}  # [Hz]
BEYOND = 1.15  # largest distance of the hand from the base, relative to the arm's reach
NOTHING = 1e-12  # [J] smaller energies count as zero: a link that is pulled along itself does not move
ROUNDING = 1e-12  # relative tolerance if hardly any joint turns
# σ_min / σ_max of the hand's Jacobian below which the arm is within about a degree of straight or folded.
SINGULAR = 0.02


class Grip(NamedTuple):
    """The held body, and the distance [m] of the held point along it."""

    body: str
    distance: float

    @property
    def reach(self) -> float:
        """Largest distance of the held point from the base [m]."""
        links = list(LENGTHS)
        return sum(LENGTHS[link] for link in links[: links.index(self.body)]) + self.distance


class Path(NamedTuple):
    """Position (2,) [m] of the target at the arc length s [m] from the start, and the length [m] of the path."""

    place: Callable[[float], Floats]
    length: float


def stretch(start: Floats, reach: float) -> Path:
    """Return a line away from the base, beyond the arm's reach, and back: the arm is straight twice."""
    return _along(start, BEYOND * reach * start / np.linalg.norm(start), start)


def across(start: Floats, reach: float) -> Path:
    """Return a line through the base to the other side and back: near the base the arm folds."""
    return _along(start, -0.9 * reach * start / np.linalg.norm(start), start)


def whirl(start: Floats, reach: float) -> Path:
    """Return a path out to the full reach and once around the base: the arm stays straight on the circle."""
    direction = start / np.linalg.norm(start)
    way_out, first = abs(reach - float(np.linalg.norm(start))), float(np.arctan2(direction[1], direction[0]))

    def place(s: float) -> Floats:
        if s < way_out:
            return start + s / way_out * (reach * direction - start)
        angle = first + (s - way_out) / reach
        return reach * np.array([np.cos(angle), np.sin(angle)])

    return Path(place, way_out + 2.0 * np.pi * reach)


def _along(*corners: Floats) -> Path:
    """The polyline through the corners."""
    points = np.array(corners)
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return Path(lambda s: np.array([np.interp(s, ways, axis) for axis in points.T]), float(ways[-1]))


PATHS: dict[str, Callable[[Floats, float], Path]] = {"stretch": stretch, "across": across, "whirl": whirl}


def _cases(study: Study) -> Iterator[tuple[str, Grip, float, float]]:
    depth = study.depth
    grips = [Grip(body, part * length) for body, length in LENGTHS.items() for part in HOLDS[depth]]
    return product(PATHS, grips, SPEEDS[depth], RATES[depth])


def _row(study: Study, case: tuple[str, Grip, float, float]) -> Row:
    path, grip, speed, rate = case
    head = {"path": path, "held link": grip.body, "held at [m]": grip.distance, "speed [m/s]": speed, "rate [Hz]": rate}
    found = operate(study.scene(SCENE), grip, path, speed, rate)
    return head | found | {"holds": holds(found)}


def operate(scene: Scene, grip: Grip, path: str, speed: float, rate: float) -> dict[str, Any]:
    """Lead the arm along one path; return the largest values and the energy balance, or nothing if it breaks off."""
    arm = Led(Simulation(scene.with_values({
        "hand.body": grip.body, "hand.point": [grip.distance, 0.0], "hand.force": [0.0, 0.0, 0.0], "rate": rate,
    })), grip)  # fmt: skip
    way = PATHS[path](arm.here, grip.reach)
    try:
        for k in range(int((way.length / speed + AFTER) * rate)):
            arm.follow(way.place(speed * k / rate), way.place(speed * (k + 1) / rate))
    except IapbError:
        return {}
    return arm.measured()


class Led:
    """An arm that the hand leads, and the measurements so far."""

    def __init__(self, simulation: Simulation, grip: Grip) -> None:
        self.simulation, self.mechanism, self.grip = simulation, simulation.system.mechanism, grip
        self.work = self.exchanged = self.put_in = 0.0
        self.largest = self.excess = self.fastest = self.strongest = 0.0
        self.ratios: list[float] = []
        self.here = self.place()

    def place(self) -> Floats:
        """Position (2,) [m] of the held point."""
        rotations, positions = self.mechanism.placements(self.simulation.state.q)
        b = self.mechanism.index(self.grip.body)
        return (positions[b] + self.grip.distance * rotations[b][:, 0])[:2]

    def follow(self, target: Floats, next_target: Floats) -> None:
        """Take one step while the target moves to its next place; add its work and update the largest values."""
        state, dt, here = self.simulation.state, self.simulation.system.dt, self.here
        jacobian = self.mechanism.point_jacobian(state.q, self.grip.body, [*here, 0.0])[:2]
        spring = STIFFNESS * (target - here)
        force = spring + DAMPING * ((next_target - target) / dt - jacobian @ state.v)
        self.simulation.step(hand_force=[*force, 0.0])
        self.here = self.place()
        work = float(force @ (self.here - here))
        self.work += work
        self.exchanged += abs(work)
        self.put_in += float(force @ (next_target - target))
        self.strongest = max(self.strongest, float(np.linalg.norm(force)))
        self.fastest = max(self.fastest, float(np.max(np.abs(state.v))))
        values = np.linalg.svd(jacobian, compute_uv=False)
        self.ratios.append(float(values[1] / values[0]) if values[0] > 0.0 else 0.0)
        tension = float(np.linalg.norm(next_target - self.here))
        stored = self.mechanism.kinetic_energy(state.q, state.v) + 0.5 * STIFFNESS * tension**2
        self.excess, self.largest = max(self.excess, stored - self.put_in), max(self.largest, stored)

    def measured(self) -> dict[str, Any]:
        """Return the values of the table row."""
        state = self.simulation.state
        kinetic, whole = self.mechanism.kinetic_energy(state.q, state.v), max(self.exchanged, NOTHING)
        return {
            "closest to singular [σ_min/σ_max]": min(self.ratios),
            "steps near singular": sum(r <= SINGULAR for r in self.ratios),
            "largest joint speed [rad/s]": self.fastest, "largest hand force [N]": self.strongest,
            "largest stored energy [J]": self.largest, "energy put in [J]": self.put_in,
            "stored beyond what was put in [relative]": self.excess / max(self.largest, NOTHING),
            "residual [relative]": (kinetic - self.work) / whole,
            "tolerance [relative]": max(self.fastest * self.simulation.system.dt, ROUNDING),
        }  # fmt: skip


def holds(found: dict[str, Any]) -> bool:
    """Whether the run is finite and was not broken off, and its energy balance closes."""
    if not found:
        return False
    figures = [value for value in found.values() if isinstance(value, float)]
    made_up = max(abs(found["residual [relative]"]), found["stored beyond what was put in [relative]"])
    return bool(np.all(np.isfinite(figures)) and made_up <= found["tolerance [relative]"])


def led(table: Table) -> str:
    """Return the number of steps near singular poses, joint speeds and energy residual in words."""
    whole = [row for row in table.records() if row["residual"] is not None]
    share = max(abs(row["residual"]) / row["tolerance"] for row in whole)
    near = sum(row["steps near singular"] for row in whole)
    return (
        f"An arm is led along {len(table.rows)} paths through its singular poses, with {near:,} steps within about a "
        f"degree of straight or folded. {len(table.rows) - len(whole)} simulations break off. No joint turns faster "
        f"than {max(row['largest joint speed'] for row in whole):.3g} rad/s, and the energy residual stays below "
        f"{share:.2g} of the first-order error estimate.")  # fmt: skip


OPERATING = Check(
    key="operating", question="Does an arm that is led pass its singular poses?", cases=_cases, row=_row, says=led,
    note="Led by any point of any link, the arm passes its singular poses with finite motion and bounded energy. "
         "Tolerance: every number is finite; the energy residual, relative to the energy exchanged, is at most the "
         "largest joint rotation per step [rad], the error of a first-order method; and arm and spring store at most "
         "that much more than the hand has put in.",
)  # fmt: skip
