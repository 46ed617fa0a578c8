"""Operating a linkage: a hand holds any link at any point and leads the arm through its singular poses.

A spring and a damper connect the hand to a target that moves along a path at a given speed; the force acts on the arm
through `Simulation.step(hand_force=...)`. The compiled step uses only J_h^T, never its inverse, so it stays finite if
J_h loses rank. The force is constant over a step, so its work on the arm is exactly F . dx, and the residual of the
energy balance is the error of the integrator.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import IapbError
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import Simulation
from verification.finding import Column, Failure, Part, Table, check_depth, of_each, table_of, verdict_of_law
from verification.mechanics.hand_paths import PATHS, Path

Floats = NDArray[np.float64]

SCENE = "held_arm"
LENGTHS = {"upper_arm": 0.3, "forearm": 0.25, "hand_link": 0.15}  # [m] of the scene's links
STIFFNESS, DAMPING = 400.0, 30.0  # of the hand [N/m, N s/m]
AFTER = 0.3  # [s] for which the hand stays at the end of its path
HOLDS = {"quick": (0.5, 1.0), "full": (0.2, 0.5, 0.8, 1.0)}  # fractions of the held link
SPEEDS = {"quick": (0.5, 4.0), "full": (0.1, 0.5, 1.0, 4.0, 8.0)}  # [m/s]
RATES = {"quick": (1000.0,), "full": (1000.0, 2000.0, 4000.0)}  # [Hz]
NOTHING = 1e-12  # [J] smaller energies count as zero: a link that is pulled along itself does not move
ROUNDING = 1e-12  # relative tolerance if hardly any joint turns
# σ_min / σ_max of the hand's Jacobian below which the arm is within about a degree of straight or folded.
SINGULAR = 0.02

COLUMNS = (
    Column("path", condition=True),
    Column("held link", condition=True),
    Column("held at", "m", condition=True),
    Column("speed", "m/s", condition=True),
    Column("rate", "Hz", condition=True),
    Column("closest to singular", "σ_min/σ_max"),
    Column("steps near singular"),
    Column("largest joint speed", "rad/s"),
    Column("largest hand force", "N"),
    Column("largest stored energy", "J"),
    Column("energy put in", "J"),
    Column("stored beyond what was put in", "relative"),
    Column("residual", "relative"),
    Column("tolerance", "relative"),
    Column("fault"),
)


class Grip(NamedTuple):
    """The held body, and the distance [m] of the held point along it."""

    body: str
    distance: float

    @property
    def reach(self) -> float:
        """Largest distance of the held point from the base [m]."""
        links = list(LENGTHS)
        return sum(LENGTHS[link] for link in links[: links.index(self.body)]) + self.distance


def operating(depth: str = "quick", failures: list[Failure] | None = None) -> Table:
    """Lead the arm by every link and point along every path, at every speed."""
    check_depth(depth)
    statement = (
        "Led by any point of any link, the arm passes its singular poses with finite motion and bounded energy."
    )
    tolerance = (
        "every number is finite; the energy residual, relative to the energy exchanged, is at most the largest joint "
        "rotation per step [rad], the error of a first-order method; and arm and spring store at most that much more "
        "than the hand has put in"
    )
    return judged(table_of(COLUMNS, _rows(depth, failures), note=f"{statement} Tolerance: {tolerance}."))


def _rows(depth: str, failures: list[Failure] | None) -> Iterator[dict[str, Any]]:
    scene = load_scene(find_scene(SCENE))
    grips = [Grip(body, part * length) for body, length in LENGTHS.items() for part in HOLDS[depth]]

    def rows_of(case: tuple[str, Grip, float, float]) -> Iterator[dict[str, Any]]:
        path, grip, speed, rate = case
        head = {"path": path, "held link": grip.body, "held at": grip.distance, "speed": speed, "rate": rate}
        yield head | operate(scene, grip, path, speed, rate)

    return of_each(product(PATHS, grips, SPEEDS[depth], RATES[depth]), rows_of, failures)


def operate(scene: Scene, grip: Grip, path: str, speed: float, rate: float) -> dict[str, Any]:
    """Lead the arm along one path and return the largest values and the energy balance."""
    held = {
        "hand.body": grip.body,
        "hand.point": [grip.distance, 0.0],
        "hand.force": [0.0, 0.0, 0.0],
        "rate": rate,
    }
    arm = Led(Simulation(scene.with_values(held)), grip)
    way = PATHS[path](arm.place(), grip.reach)
    try:
        for k in range(int((way.length / speed + AFTER) * rate)):
            arm.follow(way, speed * k / rate, speed * (k + 1) / rate)
    except IapbError as error:
        return {"fault": str(error)}
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

    def follow(self, path: Path, way: float, next_way: float) -> None:
        """Take one step while the target moves along its path from `way` to `next_way` [m]."""
        state, dt = self.simulation.state, self.simulation.system.dt
        here, target, next_target = self.here, path.place(way), path.place(next_way)
        jacobian = self.mechanism.point_jacobian(state.q, self.grip.body, [*here, 0.0])[:2]
        spring = STIFFNESS * (target - here)
        force = spring + DAMPING * ((next_target - target) / dt - jacobian @ state.v)
        self.simulation.step(hand_force=[*force, 0.0])
        self.here = self.place()
        self._account(force, self.here - here, next_target - target, jacobian)
        tension = float(np.linalg.norm(next_target - self.here))
        stored = self.mechanism.kinetic_energy(state.q, state.v) + 0.5 * STIFFNESS * tension**2
        self.excess = max(self.excess, stored - self.put_in)
        self.largest = max(self.largest, stored)

    def _account(self, force: Floats, moved: Floats, led: Floats, jacobian: Floats) -> None:
        """Add the work of one step and update the largest values."""
        work = float(force @ moved)
        self.work += work
        self.exchanged += abs(work)
        self.put_in += float(force @ led)
        self.strongest = max(self.strongest, float(np.linalg.norm(force)))
        self.fastest = max(self.fastest, float(np.max(np.abs(self.simulation.state.v))))
        values = np.linalg.svd(jacobian, compute_uv=False)
        self.ratios.append(float(values[1] / values[0]) if values[0] > 0.0 else 0.0)

    def measured(self) -> dict[str, Any]:
        """Return the values of the table row."""
        state = self.simulation.state
        kinetic, whole = self.mechanism.kinetic_energy(state.q, state.v), max(self.exchanged, NOTHING)
        return {
            "closest to singular": min(self.ratios), "steps near singular": sum(r <= SINGULAR for r in self.ratios),
            "largest joint speed": self.fastest, "largest hand force": self.strongest,
            "largest stored energy": self.largest, "energy put in": self.put_in,
            "stored beyond what was put in": self.excess / max(self.largest, NOTHING),
            "residual": (kinetic - self.work) / whole,
            "tolerance": max(self.fastest * self.simulation.system.dt, ROUNDING), "fault": "",
        }  # fmt: skip


def judged(table: Table) -> Table:
    """Judge each row: the run must be finite, without a fault, and its energy balance must close."""
    return table.judged(_holds)


def _holds(row: dict[str, Any]) -> bool:
    if row["fault"]:
        return False
    figures = [value for value in row.values() if isinstance(value, float)]
    made_up = max(abs(row["residual"]), row["stored beyond what was put in"])
    return bool(np.all(np.isfinite(figures)) and made_up <= row["tolerance"])


def led(table: Table) -> Part:
    """Return the part on led arms: distance to singular poses, joint speeds and energy residual."""
    rows = table.records()
    whole = [row for row in rows if not row["fault"]]
    share = max(abs(row["residual"]) / row["tolerance"] for row in whole)
    near = sum(row["steps near singular"] for row in whole)
    return Part(
        f"An arm is led along {len(rows)} paths through its singular poses, with {near:,} steps within about a degree "
        f"of straight or folded. {len(rows) - len(whole)} simulations break off. No joint turns faster than "
        f"{max(row['largest joint speed'] for row in whole):.3g} rad/s, and the energy residual stays below "
        f"{share:.2g} of the first-order error estimate.", verdict_of_law(table.holds))  # fmt: skip
