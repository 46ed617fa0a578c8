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
from verification.table import Row

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
    simulation = Simulation(scene.with_values({
        "hand.body": grip.body, "hand.point": [grip.distance, 0.0], "hand.force": [0.0, 0.0, 0.0], "rate": rate,
    }))  # fmt: skip
    mechanism, state, dt = simulation.system.mechanism, simulation.state, simulation.system.dt
    held, steps = mechanism.index(grip.body), list[tuple[float, ...]]()

    def place() -> Floats:
        """Position (2,) [m] of the held point."""
        rotations, positions = mechanism.placements(simulation.state.q)
        return (positions[held] + grip.distance * rotations[held][:, 0])[:2]

    here = place()
    way = PATHS[path](here, grip.reach)
    try:
        for k in range(int((way.length / speed + AFTER) * rate)):
            target, after = way.place(speed * k / rate), way.place(speed * (k + 1) / rate)
            state, before = simulation.state, here
            jacobian = mechanism.point_jacobian(state.q, grip.body, [*before, 0.0])[:2]
            force = STIFFNESS * (target - before) + DAMPING * ((after - target) / dt - jacobian @ state.v)
            simulation.step(hand_force=[*force, 0.0])
            here, values = place(), np.linalg.svd(jacobian, compute_uv=False)
            tension = float(np.linalg.norm(after - here))
            stored = mechanism.kinetic_energy(state.q, state.v) + 0.5 * STIFFNESS * tension**2
            steps.append((float(force @ (here - before)), float(force @ (after - target)), float(np.linalg.norm(force)),
                          float(np.max(np.abs(state.v))), values[1] / values[0] if values[0] > 0.0 else 0.0, stored))
    except IapbError:
        return {}
    works, given, forces, speeds, ratios, energies = np.array(steps).T
    (work, exchanged), put_in = (np.cumsum(each)[-1] for each in (works, np.abs(works))), np.cumsum(given)
    kinetic, largest = mechanism.kinetic_energy(state.q, state.v), float(energies.max())
    return {
        "closest to singular [σ_min/σ_max]": float(ratios.min()),
        "steps near singular": int(np.sum(ratios <= SINGULAR)),
        "largest joint speed [rad/s]": float(speeds.max()), "largest hand force [N]": float(forces.max()),
        "largest stored energy [J]": largest, "energy put in [J]": float(put_in[-1]),
        "stored beyond what was put in [relative]": max(0.0, float((energies - put_in).max())) / max(largest, NOTHING),
        "residual [relative]": float(kinetic - work) / max(float(exchanged), NOTHING),
        "tolerance [relative]": max(float(speeds.max()) * dt, ROUNDING),
    }  # fmt: skip


def holds(found: dict[str, Any]) -> bool:
    """Whether the run is finite and was not broken off, and its energy balance closes."""
    if not found:
        return False
    figures = [value for value in found.values() if isinstance(value, float)]
    made_up = max(abs(found["residual [relative]"]), found["stored beyond what was put in [relative]"])
    return bool(np.all(np.isfinite(figures)) and made_up <= found["tolerance [relative]"])


OPERATING = Check(
    key="operating", cases=_cases, row=_row, spans=("steps near singular", "largest joint speed"),
    question="Led by any point of any link, the arm passes its singular poses with finite motion and bounded energy.",
    note="A row holds if every number is finite and two errors are at most the tolerance, the largest joint rotation "
    "per step [rad]: the residual of the energy balance, relative to the sum of the hand's |work| over all steps, and "
    "the energy that arm and spring store beyond what the hand has put in. Near singular: σ_min/σ_max of the hand's "
    f"Jacobian is at most {SINGULAR:g}.",
)  # fmt: skip
