"""Topic: IAPB and its three assumptions against complementarity, in outcome and in cost."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from iapb.scene import find_scene, load_scene, scene_names
from reference.complementarity.laws import LAWS
from reference.worlds import WORLDS
from verification.check import Check, Study, Topic
from verification.complementarity.agreement import MAP, TWO_CONTACTS
from verification.complementarity.convergence import CONVERGENCE
from verification.complementarity.extensions import FRICTION, UNEQUAL
from verification.complementarity.piles import piles
from verification.complementarity.solvers import OWN, SOLVER_LIST, collections
from verification.cost.solvers import IMPACT_TIMES
from verification.finding import REFUTED, REPRODUCED, Part
from verification.mechanics.against_pinocchio import scene_difference
from verification.table import Row, Table

# Optional folder of contact problems by others, next to the project. A clone does not need it.
FOLDER = Path(__file__).resolve().parents[3] / "shared" / "problems"
CONFIGURATIONS = (
    20  # number of configurations of each scene in which engine and references are compared
)
# Largest difference of engine and references: the rounding of some dozens of products of entries of
# size one.
SAME_MECHANICS = 1e-12
WORLD_SCENE = "peg_corner"


def complementarity(folders: Mapping[str, Path], worlds: Iterable[str] = ()) -> Topic:
    """Return the comparison on random impacts, scenes, extensions, cost, and folders of problem
    files by name.

    worlds : those whose contact law and coupling are listed
    """
    return Topic(
        key="complementarity",
        title="Against complementarity",
        question="IAPB solves (21): every colliding contact separates at e times its approach speed, and impulses "
        "may pull. A linear complementarity problem (LCP) allows only pushing impulses and "
        "decides which contacts "
        "push. Both laws are applied to the same impacts: random impacts of known geometry, "
        "impacts of the project's "
        "scenes, and problems that solvers find hard. A solver's solution counts only if its "
        "residuals, recomputed "
        "from the problem, are small. Velocities after the impact are compared in the kinetic "
        "metric, relative to "
        "|v⁻|.",
        checks=(
            MAP,
            TWO_CONTACTS,
            piles(folders.values()),
            FRICTION,
            UNEQUAL,
            CONVERGENCE,
            REFERENCES,
            IMPACT_TIMES,
            *collections({OWN: None, **folders}),
            LAW_LIST,
            SOLVER_LIST,
            *([_world_list(worlds)] if worlds else []),
        ),
        says=_answer,
    )


def _answer(tables: Mapping[str, Table], parts: Sequence[Part]) -> str:
    found = tables["map"]
    cases = sum(found["cases"]) or 1
    agree = sum(row["share that agrees"] * row["cases"] for row in found.records()) / cases
    held, fail = (
        sum(part.verdict == verdict for part in parts) for verdict in (REPRODUCED, REFUTED)
    )
    return (
        f"IAPB and the LCP with Newton's law of restitution give the same velocity in {agree:.0%} "
        f"of {cases:,} "
        "impacts, random ones and those of our scenes (another choice of impacts would give "
        "another share). "
        f"They agree if and only if pushing impulses (p >= 0) can produce IAPB's velocity: "
        f"{sum(found['contradictions']) or 'no'} exceptions were found. Of the {len(parts)} "
        f"findings on the page, "
        f"{held} hold in full, {len(parts) - held - fail} in part, and {fail} "
        f"{'fails' if fail == 1 else 'fail'}."
    )


REFERENCES = Check(
    key="references",
    question="The engine's mass matrix M and forces B + G (Coriolis, centripetal, gravity) agree to "
    "1e-12 with Pinocchio.",
    cases=lambda study: scene_names(),
    digits=2,
    row=lambda study, name: scene_difference(load_scene(find_scene(name)), CONFIGURATIONS),
    holds=lambda row: max(row["M"], row["B + G"]) <= SAME_MECHANICS,
    note="Largest differences between engine and reference, relative to the largest entry.",
)


def _law(study: Study, name: str) -> Row:
    law = LAWS[name]
    return {
        "law": law.name,
        "statement": law.statement,
        "source": law.source,
        "hypotheses": law.hypotheses,
        "never gains energy under them": law.never_gains_energy,
    }


LAW_LIST = Check(
    key="laws",
    question="",
    cases=lambda study: LAWS,
    row=_law,
    note="gamma: normal velocities of the contacts; E: diagonal matrix of their e; p: impulses; c: of the compression, "
    "e: of the rebound. K: Coulomb's friction cone; K*: its dual; u: contact velocities, u_T their tangential parts.",
)


def _world(study: Study, world: str) -> Row:
    run = study.run(study.scene(WORLD_SCENE), world, keep=False)
    return {
        "world": world,
        "contact law": run.law,
        "its settings": _settings(run.law_settings),
        "coupling": run.coupling,
        "its gains": _settings(run.coupling_settings),
    }


def _settings(values: Any) -> str:
    texts = (
        f"{name} {json.dumps(value, ensure_ascii=False)}" for name, value in dict(values).items()
    )
    return ", ".join(texts) or "none"


def _world_list(worlds: Iterable[str]) -> Check:
    return Check(
        key="worlds",
        question="",
        cases=lambda study: worlds,
        row=_world,
        note=f"From the run file of {WORLD_SCENE} in each world.",
    )


TOPIC = complementarity({"published problems": FOLDER} if FOLDER.is_dir() else {}, WORLDS)
