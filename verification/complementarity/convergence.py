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
from verification.data import data_of
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
    """A case of truths.yaml."""

    scene: str
    duration: float
    coupled: bool = False
    quick: bool = False


CASES = tuple(
    TruthCase(scene, **given) for scene, given in data_of(__file__, "truths.yaml").items()
)
QUICK = tuple(case for case in CASES if case.quick)


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


CONVERGENCE = Check(
    key="convergence",
    question="Does the rigid world converge to the event-driven solution, at least at first order?",
    cases=lambda study: CASES if study.depth == "full" else QUICK,
    row=lambda study, case: converge(case),
    targets=no_row_fails("scenes in which the rigid world does not converge"),
)
