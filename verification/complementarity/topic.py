"""Topic: when formula (21) and complementarity agree, and our mechanics beside Pinocchio's."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from verification.check import Topic
from verification.complementarity.agreement import MAP, SCENE, TWO_CONTACTS
from verification.complementarity.convergence import CONVERGENCE
from verification.complementarity.extensions import FRICTION, UNEQUAL
from verification.complementarity.landings import LANDINGS, PEG
from verification.complementarity.piles import PILES
from verification.complementarity.solvers import SOLVER_TABLE, collections
from verification.mechanics.against_pinocchio import AGAINST_PINOCCHIO, IMPULSE_DYNAMICS
from verification.mechanics.definiteness import POSITIVE_DEFINITE
from verification.numbers import Values
from verification.table import Table


def _numbers(tables: Mapping[str, Table]) -> Values:
    """Return what the page quotes."""
    found = tables[MAP.key]
    grid = tables[TWO_CONTACTS.key]
    landings = tables[LANDINGS.key]
    scenes = found.where(kind=SCENE)
    piles = tables[PILES.key]
    return {
        "impacts": sum(found["cases"]),
        "contradictions": sum(found["contradictions"]),
        "points": len(grid.rows),
        "points_as_predicted": sum(grid.decided),
        "peg_c": landings.where(impact=PEG)["c"][0],
        "scene_impacts": sum(scenes["cases"]),
        "scene_impacts_that_pull": sum(scenes["differ"]),
        "pile_limit": max(piles["most contacts that agree"]),
        "pushing_from_the_lcp": max(piles["pushing only, from the LCP"]),
    }


def complementarity(folders: Mapping[str, Path]) -> Topic:
    """Return the topic, with folders of problem files by name."""
    return Topic(
        key="complementarity",
        title="Complementarity",
        question="When do impulses by formula and by complementarity agree?",
        checks=(
            MAP,
            TWO_CONTACTS,
            LANDINGS,
            PILES,
            FRICTION,
            UNEQUAL,
            CONVERGENCE,
            SOLVER_TABLE,
            AGAINST_PINOCCHIO,
            IMPULSE_DYNAMICS,
            POSITIVE_DEFINITE,
            *collections(folders),
        ),
        numbers=_numbers,
    )


TOPIC = complementarity({})
