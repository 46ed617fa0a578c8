"""Compare the "ideal" world with the event-driven solution (the "truth") on every scene that has
such a solution.

The errors are at most proportional to the step, for impacts happen within steps. They are measured before
impacts accumulate: positions in the sup norm, velocities in L¹ over time, because a small shift of an impact in time
changes the velocity by the whole jump. Each of two levels has several step lengths, because the
position of an impact within a step is arbitrary. The order of convergence follows from the largest
errors of the two levels.

The folder `scenes` beside this module has small scenes in space that have such a solution; only
this study uses them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iapb.errors import SolverError
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate
from reference.scene_events import SceneTruth, scene_truth
from reference.time_stepping import RigidConstraints
from reference.worlds import find_world
from verification.check import Check, no_row_fails
from verification.table import HOLDS

TRUTH_SCENES = {
    path.stem: path for path in sorted((Path(__file__).parent / "scenes").glob("*.yaml"))
}
# rates [Hz]; a factor of four between the levels
COARSE = (470.0, 500.0, 530.0)
FINE = (1880.0, 2000.0, 2120.0)
_LEVELS = 4.0
# The convergence counts as first order if the errors per step on the fine level are at most this
# multiple of those on the coarse level. The positions of impacts within steps change the errors by
# a factor below two on all scenes; errors that do not shrink at all would give a factor of four.
BOUNDED = 2.5
# The truth's own error may be at most this share of the errors on the fine level: it changes an
# order by at most 0.1.
WORTH = 0.1
_ROUNDING = 1e-7  # per second of step: smaller errors are rounding and count as zero


class TruthCase(NamedTuple):
    """A scene, a duration before its impacts accumulate [s], and whether the run includes device
    and coupling."""

    scene: str
    duration: float
    coupled: bool


CASES = (
    # one elastic impact
    TruthCase("two_discs", 0.2, False),
    # four elastic impacts, one after another
    TruthCase("newton_cradle", 0.2, False),
    # two simultaneous elastic impacts
    TruthCase("bernoulli_balls", 0.1, False),
    # plastic impact, contact that holds and lets go
    TruthCase("two_link_arm_a", 0.3, False),
    # plastic impact that takes all
    TruthCase("two_link_arm_b", 0.3, False),
    # no contact: the integrator alone
    TruthCase("double_pendulum", 0.5, False),
    # plastic impact and rest, with device and coupling
    TruthCase("wall_1d", 1.0, True),
    # three plastic impacts, with device and coupling
    TruthCase("peg_corner", 0.36, True),
    # two plastic impacts, with device and coupling
    TruthCase("peg_room", 0.36, True),
    # six contacts at once, with device and coupling
    TruthCase("peg_hole", 0.36, True),
    # one impact (e = 0.2) between moving bodies, before they accumulate
    TruthCase("arm_pushing", 0.1, True),
    # plastic impacts between moving bodies
    TruthCase("three_link_arm_plastic", 0.45, False),
    # elastic impacts between moving bodies
    TruthCase("three_link_arm_elastic", 0.45, False),
    # no contact: the hand pulls at a linkage
    TruthCase("held_arm", 0.3, False),
    # in space, no contact: quaternions and Euler's equations alone
    TruthCase("tumbling_body", 0.5, False),
    # in space: one impact (e = 0.6) of a spinning, eccentric ball
    TruthCase("ball_dropped_in_space", 0.3, False),
    # in space: impacts (e = 0.3) of two corners of a turning box
    TruthCase("box_dropped_in_space", 0.2, False),
    # in space: plastic impact of a corner, about which the box turns
    TruthCase("box_landing_in_space", 0.19, False),
    # in space: spheres of unequal mass, two impacts (e = 0.7)
    TruthCase("cradle_in_space", 0.1, False),
    # in space: an arm's plastic impact, contact that holds
    TruthCase("arm_meets_a_wall_in_space", 0.3, False),
)


def converge(case: TruthCase, law: Any = None) -> list[dict[str, Any]]:
    """Return the row of each level on one case; `law` replaces the contact law of the rigid world.

    A row has the largest errors of three steps, positions in the sup norm over time and
    coordinates, velocities in the L¹ norm over time, largest over the coordinates. The outcome, in
    the row of the fine level, is whether the errors divided by the step stay bounded. An order is
    None if the errors are rounding alone.
    """
    scene = scene_of(case.scene)
    truth = scene_truth(scene, case.duration, case.coupled)
    law = law or RigidConstraints()
    levels = [
        np.max([_errors(scene, case, truth, law, rate) for rate in level], axis=0)
        for level in (COARSE, FINE)
    ]
    _require_worth(case, truth, *levels[1])
    (position, velocity) = zip(*levels, strict=True)
    rows = []
    for rates, errors in zip((COARSE, FINE), levels, strict=True):
        step = len(rates) / sum(rates)
        rows.append(
            {
                "scene": case.scene,
                "events": len(truth.events),
                "step [ms]": 1e3 * step,
                "error of positions": float(errors[0]) * step,
                "error of velocities": float(errors[1]) * step,
                "order, positions": _order(*position),
                "order, velocities": _order(*velocity),
                HOLDS: None,
            }
        )
    rows[1][HOLDS] = all(
        fine <= max(BOUNDED * coarse, _ROUNDING) for coarse, fine in (position, velocity)
    )
    return rows


def _order(coarse: float, fine: float) -> float | None:
    """Return log₄ of the ratio of the largest errors, plus one because they are errors divided by
    the step."""
    return (
        float(1.0 + np.log(coarse / fine) / np.log(_LEVELS))
        if min(coarse, fine) > _ROUNDING
        else None
    )


def _require_worth(case: TruthCase, truth: SceneTruth, position: float, velocity: float) -> None:
    """Raise SolverError if the bounds of the truth's errors, in the same norms, are too large to
    compare with."""
    bound = truth.bound
    last = min(1.0 / rate for rate in FINE)
    _, v = truth.state(np.linspace(0.0, truth.end, 101))
    # L¹ error of late or early jumps
    jumps = 2.0 * float(np.abs(v).max()) * bound.instant * len(truth.events)
    worth = bound.position, bound.velocity * case.duration + jumps
    for error, measured in zip(worth, (position, velocity), strict=True):
        if error > max(WORTH * measured, _ROUNDING) * last:
            raise SolverError(
                f"{case.scene}: no reference: its error is {error:.1e}, "
                f"that of the steps {measured * last:.1e}"
            )


def scene_of(name: str) -> Scene:
    """Return a scene of the folder `scenes` beside this module, or of the project, by name."""
    return load_scene(TRUTH_SCENES.get(name) or find_scene(name))


def _errors(
    scene: Scene, case: TruthCase, truth: SceneTruth, law: Any, rate: float
) -> tuple[float, float]:
    """Return the errors of positions (sup norm) and velocities (L¹ norm), both divided by the
    step."""
    steps = int(np.floor(case.duration * rate))
    stepped = scene.with_values({"rate": rate, "duration": case.duration})
    coupling = find_world("ideal").coupling_in(stepped) if case.coupled else None
    run = simulate(stepped, law, coupling, steps=steps)
    q, v = truth.state(np.minimum(run.time, truth.end))
    return float(np.abs(run.q - q).max() * rate), float(np.abs(run.v - v).sum(axis=0).max())


# the scenes of the quick depth
QUICK = (
    "two_discs",
    "bernoulli_balls",
    "two_link_arm_a",
    "peg_corner",
    "peg_hole",
    "arm_pushing",
    "ball_dropped_in_space",
)


CONVERGENCE = Check(
    key="convergence",
    question="Does the rigid world converge to the event-driven solution, at least at first order?",
    cases=lambda study: [case for case in CASES if study.depth == "full" or case.scene in QUICK],
    row=lambda study, case: converge(case),
    targets=no_row_fails("scenes in which the rigid world does not converge"),
)
