"""Compare the "ideal" world with the event-driven solution (the "truth") on every scene that has such a solution.

The errors should be proportional to the step. They are measured before impacts accumulate: positions in the sup norm,
velocities in L¹ over time, because a small shift of an impact in time changes the velocity by the whole jump. Each of
two levels has several step lengths, because the position of an impact within a step is arbitrary. The order of
convergence follows from the largest errors of the two levels.

TRUTH_SCENES are small scenes in space that have an event-driven solution; only this study uses them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.errors import SolverError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.simulation import simulate
from reference.scene_events import SceneTruth, scene_truth
from reference.time_stepping import RigidConstraints
from reference.worlds import find_world

COARSE, FINE = (470.0, 500.0, 530.0), (1880.0, 2000.0, 2120.0)  # rates [Hz]; a factor of four between the levels
_LEVELS = 4.0
# The convergence counts as first order if the errors per step on the fine level are at most this multiple of those on
# the coarse level. The positions of impacts within steps change the errors by a factor below two on all scenes; errors
# that do not shrink at all would give a factor of four.
BOUNDED = 2.5
# The truth's own error may be at most this share of the errors on the fine level: it changes an order by at most 0.1.
WORTH = 0.1
_ROUNDING = 1e-7  # per second of step: smaller errors are rounding and count as zero


@dataclass(frozen=True)
class TruthCase:
    """A scene, a duration before its impacts accumulate [s], and whether the run includes device and coupling."""

    scene: str
    duration: float
    coupled: bool
    why: str


CASES = (
    TruthCase("two_discs", 0.2, False, "one elastic impact"),
    TruthCase("newton_cradle", 0.2, False, "four elastic impacts, one after another"),
    TruthCase("bernoulli_balls", 0.1, False, "two simultaneous elastic impacts"),
    TruthCase("two_link_arm_a", 0.3, False, "plastic impact, contact that holds and lets go"),
    TruthCase("two_link_arm_b", 0.3, False, "plastic impact that takes all"),
    TruthCase("double_pendulum", 0.5, False, "no contact: the integrator alone"),
    TruthCase("wall_1d", 1.0, True, "plastic impact and rest, with device and coupling"),
    TruthCase("peg_corner", 0.36, True, "three plastic impacts, with device and coupling"),
    TruthCase("peg_room", 0.36, True, "two plastic impacts, with device and coupling"),
    TruthCase("peg_hole", 0.36, True, "six contacts at once, with device and coupling"),
    TruthCase("arm_pushing", 0.1, True, "one impact (e = 0.2) between moving bodies, before they accumulate"),
    TruthCase("three_link_arm_plastic", 0.45, False, "plastic impacts between moving bodies"),
    TruthCase("three_link_arm_elastic", 0.45, False, "elastic impacts between moving bodies"),
    TruthCase("held_arm", 0.3, False, "no contact: the hand pulls at a linkage"),
    TruthCase("tumbling_body", 0.5, False, "in space, no contact: quaternions and Euler's equations alone"),
    TruthCase("ball_dropped_in_space", 0.3, False, "in space: one impact (e = 0.6) of a spinning, eccentric ball"),
    TruthCase("box_dropped_in_space", 0.2, False, "in space: impacts (e = 0.3) of two corners of a turning box"),
    TruthCase("box_landing_in_space", 0.19, False, "in space: plastic impact of a corner, about which the box turns"),
    TruthCase("cradle_in_space", 0.1, False, "in space: spheres of unequal mass, two impacts (e = 0.7)"),
    TruthCase("arm_meets_a_wall_in_space", 0.3, False, "in space: an arm's plastic impact, contact that holds"),
)  # fmt: skip
WITHOUT_TRUTH = {
    "bar_on_posts": "its walls differ in restitution, of which exact events of Newton's law know one",
    "box_stack": "rests on overlaps that only penalties have",
    "faceted_socket": "impacts accumulate as the ball comes to rest",
    "sliding_box": "starts sunk in by its weight, which only penalties have",
    "arm_obstacles": "its block starts 0.1 mm in the table, an overlap that only penalties have",
    "peg_hole_space": "its clutter starts 0.05 mm in the plate, an overlap that only penalties have",
}


@dataclass(frozen=True)
class ConvergenceRow:
    """One scene and scheme: the largest error per step on each level, and the order between the two levels.

    position_coarse, position_fine : sup norm over time and coordinates, per second of step [m/s, rad/s]
    velocity_coarse, velocity_fine : L¹ norm over time, largest over the coordinates, per second of step
    truth_error : bounds of the truth's own errors, for positions [m, rad] and for velocities [m, rad]
    """

    scene: str
    scheme: str
    coupled: bool
    duration: float
    events: int
    position_coarse: float
    position_fine: float
    velocity_coarse: float
    velocity_fine: float
    truth_error: tuple[float, float] = (np.nan, np.nan)

    @property
    def position_order(self) -> float:
        """log₄ of the ratio of the largest position errors; infinite if these are rounding alone."""
        return _order(self.position_coarse, self.position_fine)

    @property
    def velocity_order(self) -> float:
        """log₄ of the ratio of the largest velocity errors; infinite if these are rounding alone."""
        return _order(self.velocity_coarse, self.velocity_fine)

    @property
    def first_order(self) -> bool:
        """Whether the errors per step stay bounded."""
        return _bounded(self.position_coarse, self.position_fine) and _bounded(self.velocity_coarse, self.velocity_fine)


def _order(coarse: float, fine: float) -> float:
    return float(1.0 + np.log(coarse / fine) / np.log(_LEVELS)) if min(coarse, fine) > _ROUNDING else np.inf


def _bounded(coarse: float, fine: float) -> bool:
    return fine <= max(BOUNDED * coarse, _ROUNDING)


def convergence(
    cases: Sequence[TruthCase] = CASES, scheme: str = "automatic",
    progress: Callable[[str, int, int], None] | None = None,
) -> tuple[ConvergenceRow, ...]:
    """Measure the convergence of the rigid world on each case."""
    rows = []
    for done, case in enumerate(cases):
        rows.append(converge(case, scheme=scheme))
        if progress is not None:
            progress("convergence to event-driven truth", done + 1, len(cases))
    return tuple(rows)


def converge(case: TruthCase, law: Any = None, scheme: str = "automatic") -> ConvergenceRow:
    """Measure the convergence on one case; `law` replaces the contact law of the rigid world."""
    scene = scene_of(case.scene)
    truth, law = scene_truth(scene, case.duration, case.coupled), law or RigidConstraints(scheme=scheme)
    levels = [np.max([_errors(scene, case, truth, law, rate) for rate in level], axis=0) for level in (COARSE, FINE)]
    (position_coarse, velocity_coarse), (position_fine, velocity_fine) = levels
    return ConvergenceRow(
        case.scene, scheme, case.coupled, case.duration, len(truth.events), float(position_coarse),
        float(position_fine), float(velocity_coarse), float(velocity_fine),
        _worth(case, truth, position_fine, velocity_fine),
    )  # fmt: skip


def _worth(case: TruthCase, truth: SceneTruth, position: float, velocity: float) -> tuple[float, float]:
    """Return bounds of the truth's errors in the same norms; raise SolverError if they are too large to compare."""
    bound, last = truth.bound, min(1.0 / rate for rate in FINE)
    _, v = truth.state(np.linspace(0.0, truth.end, 101))
    jumps = 2.0 * float(np.abs(v).max()) * bound.instant * len(truth.events)  # L¹ error of late or early jumps
    worth = bound.position, bound.velocity * case.duration + jumps
    for error, measured in zip(worth, (position, velocity), strict=True):
        if error > max(WORTH * measured, _ROUNDING) * last:
            raise SolverError(f"{case.scene}: no reference: its error is {error:.1e}, "
                              f"that of the steps {measured * last:.1e}")
    return worth


def scene_of(name: str) -> Scene:
    """Return a scene of TRUTH_SCENES or of the project by name."""
    return scene_from_text(TRUTH_SCENES[name]) if name in TRUTH_SCENES else load_scene(find_scene(name))


def _errors(scene: Scene, case: TruthCase, truth: SceneTruth, law: Any, rate: float) -> tuple[float, float]:
    """Return the errors of positions (sup norm) and velocities (L¹ norm), both divided by the step."""
    steps = int(np.floor(case.duration * rate))
    stepped = scene.with_values({"rate": rate, "duration": case.duration})
    coupling = find_world("ideal").coupling_in(stepped) if case.coupled else None
    run = simulate(stepped, law, coupling, steps=steps)
    q, v = truth.state(np.minimum(run.time, truth.end))
    return float(np.abs(run.q - q).max() * rate), float(np.abs(run.v - v).sum(axis=0).max())


_DROPPED = """
name: %s
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: body, joint: free_flyer, mass: 0.5, inertia: [2e-4, 3e-4, 4e-4], shapes: [%s],
     position: [0, 0, 0.2, 0, 0, 0, 1], velocity: [0.3, -0.2, 0, %s]}
walls: [{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0.1, 1]}]
contact: {forces: paper, restitution: %g, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""
_BALL, _BOX = "{kind: sphere, radius: 0.04, center: [0.01, 0, 0]}", "{kind: box, size: [0.06, 0.08, 0.03]}"

_SPHERE = (
    "  - {name: ball_%d, joint: free_flyer, mass: %g, inertia: [1e-4, 1e-4, 1e-4], "
    "shapes: [{kind: sphere, radius: 0.02}],\n     position: [%g, 0, 0, 0, 0, 0, 1], velocity: [%g, 0, 0, 0, 0, 0]}\n"
)
_CRADLE = (
    "name: cradle_in_space\ndimensions: 3\nrate: 1000\nduration: 1\nbodies:\n"
    + "".join(_SPHERE % row for row in ((0, 0.2, 0.0, 1.0), (1, 0.4, 0.0613, 0.0), (2, 0.2, 0.1227, 0.0)))
    + "contact: {forces: paper, restitution: 0.7, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}\n"
)

_SWINGING_ARM = """
name: arm_meets_a_wall_in_space
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: upper, joint: spherical, mass: 1, inertia: [2e-3, 1e-2, 1e-2], center_of_mass: [0.15, 0, 0]}
  - {name: lower, parent: upper, joint: revolute, axis: [0, 1, 0], origin: [0.3, 0, 0], mass: 0.5,
     inertia: [1e-3, 4e-3, 4e-3], center_of_mass: [0.1, 0, 0], velocity: [1],
     shapes: [{kind: sphere, radius: 0.03, center: [0.25, 0, 0]}]}
walls: [{name: wall, kind: half_space, point: [0, 0, -0.2], normal: [0.2, 0, 1]}]
contact: {forces: paper, restitution: 0, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""

TRUTH_SCENES = {
    "ball_dropped_in_space": _DROPPED % ("ball_dropped_in_space", _BALL, "5, 3, 1", 0.6),
    "box_dropped_in_space": _DROPPED % ("box_dropped_in_space", _BOX, "3, 2, 1", 0.3),
    "box_landing_in_space": _DROPPED % ("box_landing_in_space", _BOX, "3, 2, 1", 0.0),
    "cradle_in_space": _CRADLE,
    "arm_meets_a_wall_in_space": _SWINGING_ARM,
}
