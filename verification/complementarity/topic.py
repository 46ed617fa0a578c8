"""Topic: when formula (21) and complementarity agree, and our mechanics beside Pinocchio's."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from verification.check import Topic
from verification.complementarity.agreement import MAP, TWO_CONTACTS
from verification.complementarity.convergence import CONVERGENCE
from verification.complementarity.extensions import FRICTION, UNEQUAL
from verification.complementarity.landings import LANDINGS
from verification.complementarity.piles import PILES
from verification.complementarity.solvers import SOLVER_TABLE, collections
from verification.data import data_of
from verification.mechanics.against_pinocchio import AGAINST_PINOCCHIO, IMPULSE_DYNAMICS
from verification.mechanics.definiteness import POSITIVE_DEFINITE
from verification.numbers import quoted


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
        numbers=partial(quoted, data_of(__file__, "numbers.yaml")),
    )


TOPIC = complementarity({})
