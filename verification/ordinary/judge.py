"""Which ordinary scenes come out right, in our default world and in MuJoCo."""

from __future__ import annotations

from importlib.util import find_spec

from iapb.run import Run
from iapb.scene.mechanism import mechanism_of
from iapb.scene.reading import scene_from_values
from reference.worlds import run_world
from verification.check import Check, Study, no_row_fails
from verification.ordinary.quantities import Motion
from verification.ordinary.scenes import CASES
from verification.scenes.books import scene_of
from verification.scenes.points import placed
from verification.table import Row

OURS = "IAPB"
THEIRS = "MuJoCo"
WORLDS = {OURS: "IAPB"}
if find_spec("mujoco"):
    WORLDS[THEIRS] = "mujoco"


def motion_of(run: Run) -> Motion:
    """Return the motion of a run."""
    mechanism = mechanism_of(scene_of(run))
    return Motion(run.time, *placed(mechanism, run.q))


def error_in(name: str, world: str) -> float | None:
    """Return the error of an ordinary scene in a world, in units of what counts as right; None if
    the run stops early."""
    case = CASES[name]
    run = run_world(scene_from_values(case.scene), world, partial=True)
    if not run.complete:
        return None
    return case.error(motion_of(run)) / case.tolerance


def _row(study: Study, name: str) -> Row:
    errors = {title: error_in(name, world) for title, world in WORLDS.items()}
    return {
        "scene": name,
        "family": CASES[name].family,
        "known": CASES[name].says,
        "allowed, of the scale": CASES[name].tolerance,
        **{f"error of {title}, of the allowed": error for title, error in errors.items()},
        **{
            f"{title} is right": error is not None and error <= 1.0
            for title, error in errors.items()
        },
    }


ORDINARY = Check(
    key="ordinary",
    question="Do scenes of the first day come out right in the default world, at a step of 1 ms?",
    cases=lambda study: CASES,
    row=_row,
    holds=lambda row: bool(row[f"{OURS} is right"]),
    targets=no_row_fails("ordinary scenes that come out wrong"),
)
