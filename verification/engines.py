"""Topic "engines": the project's scenes in MuJoCo and in IAPB, beside rigid contact.

Every scene keeps its bodies, walls, friction and restitution. It gets the default contact, and the
hand holds the tool itself: what MuJoCo has nothing like is left out, so that all worlds simulate
the same scene.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec

import numpy as np

from iapb.errors import installing
from iapb.scene import scene_names
from verification.check import Check, Study, Topic
from verification.finding import Part, verdict_of_trials
from verification.laws.worlds import any_scene
from verification.table import Row, Table
from verification.worlds import compare_worlds

MOST_STEPS = {"quick": 150, "full": 2000}  # simulated of a scene
# The boxes of the first start as deep in each other as its own springs give way; a step of rigid
# contact with friction takes seconds in the second.
LEFT_OUT = ("box_stack", "peg_hole_space")
SAME = 1e-3  # [mm] a difference that does not count


def _row(study: Study, name: str) -> Row:
    """Return how far both worlds are from rigid contact, and what they make of energy."""
    given = study.scene(name)
    duration = min(given.duration, MOST_STEPS[study.depth] * given.step)
    scene = any_scene(given.resolved() | {"duration": duration})
    found = compare_worlds(scene, ["IAPB", "mujoco"], impacts=0)
    table = found.tables["worlds"]
    ours, theirs, rigid = (
        table.where(world=world).records()[0]
        for world in ("IAPB", "mujoco", found.details["against"])
    )
    return {
        "scene": name,
        "simulated [s]": duration,
        "IAPB apart [mm]": 1e3 * ours["configuration, rms"],
        "MuJoCo apart [mm]": 1e3 * theirs["configuration, rms"],
        "rigid contact's own error [mm]": 1e3 * rigid["configuration, rms"],
        "IAPB above start and work [J]": ours["most above start and work"],
        "MuJoCo above start and work [J]": theirs["most above start and work"],
    }


def _scenes(study: Study) -> list[str]:
    """Return the names of the scenes; none if MuJoCo is not installed."""
    if find_spec("mujoco") is None:
        return []
    return [name for name in scene_names() if name not in LEFT_OUT]


def _is_as_near(row: Row) -> bool | None:
    """Whether IAPB is at least as near to rigid contact as MuJoCo; None if the difference is below
    the error of rigid contact."""
    farther = row["IAPB apart"] - row["MuJoCo apart"]
    if SAME < abs(farther) <= row["rigid contact's own error"]:
        return None
    return bool(farther <= SAME)


def _answer(tables: Mapping[str, Table], parts: Sequence[Part]) -> str:
    table = tables[SCENES.key]
    if not table.rows:
        return f"MuJoCo is not installed: {installing('reference')}."
    medians = [float(np.median(table.column(f"{name} apart"))) for name in ("IAPB", "MuJoCo")]
    return (
        f"In the median of {len(table.rows)} scenes IAPB is {medians[0]:.2g} mm from rigid "
        f"contact, and MuJoCo "
        f"{medians[1]:.2g} mm."
    )


SCENES = Check(
    key="scenes",
    question="IAPB is at least as near to rigid contact as MuJoCo.",
    cases=_scenes,
    row=_row,
    holds=_is_as_near,
    rule=verdict_of_trials,
    digits=3,
    note="Apart: distance from the ideal world, in a scene with friction from ideal-friction; root mean square over "
    "mass and time. Own error: distance of the rigid world from itself at half its step; worlds that differ by less "
    "are not ordered. Above start and work: the largest rise of kinetic plus potential energy above "
    "the start and the "
    "work of the hand. Two scenes are left out: the boxes of box_stack start inside each other, "
    "where its own springs balance them, and rigid contact is too slow in peg_hole_space.",
)
engines = Topic(
    key="engines",
    title="Other engines",
    question="Every scene of the project is simulated in IAPB, in MuJoCo and with rigid contact, at the scene's own "
    "step. The scenes have the default contact, and the hand holds the tool itself, so that all "
    "worlds simulate the "
    "same. MuJoCo's settings follow from one rule (docs/engines.md).",
    checks=(SCENES,),
    says=_answer,
)
