"""Time of the mass matrix and the bias, per call and for many states in one call, compared with
Pinocchio in Python.

Pinocchio is called in its fastest form, a bound function whose result is discarded. Both sides take
turns, so that a slow phase of the machine affects both; the ratio of each round is compared.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_state
from reference.rigid_body import calls_from_urdf
from verification.check import Check, Study
from verification.clock import seconds, take_turns
from verification.mechanics.against_pinocchio import SEED, robot_files, shipped_robots
from verification.table import Columns, Row

STATES = 200  # random states, one call each, in one round
ROUNDS = {"quick": 25, "full": 200}
ONE = "one state per call"
MANY = f"{STATES} states in one call"
LIMITS = {ONE: 3.0, MANY: 1.0}  # target of the ratio
FILES = {path.stem: path for path in robot_files() or shipped_robots()}


def time_robot(study: Study, name: str) -> Iterator[Row]:
    """Yield the times of both quantities in both forms for one robot."""
    mechanism = Mechanism.from_urdf(FILES[name])
    rng = np.random.default_rng(SEED)
    states = [random_state(rng, mechanism) for _ in range(STATES)]
    qs, vs = (np.array(rows) for rows in zip(*states, strict=True))
    their_mass, their_bias = calls_from_urdf(FILES[name])
    places = [(q,) for q, _ in states]
    one = (
        ("mass matrix", mechanism.mass_matrix, their_mass, places),
        ("bias", mechanism.bias, their_bias, states),
    )
    many = {
        "mass matrix": lambda: mechanism.mass_matrices(qs),
        "bias": lambda: mechanism.biases(qs, vs),
    }
    for form in LIMITS:
        for quantity, ours, theirs, given in one:
            calls = {
                "ours": partial(_for_each, ours, given) if form == ONE else many[quantity],
                "theirs": partial(_for_each, theirs, given),
            }
            times = take_turns(
                {who: partial(seconds, call) for who, call in calls.items()}, ROUNDS[study.depth]
            )
            ratio = times["ours"].over(times["theirs"])
            yield {
                "robot": name,
                "velocities": mechanism.nv,
                "quantity": quantity,
                "form": form,
                "ours [µs]": 1e6 / STATES * times["ours"].median,
                "Pinocchio [µs]": 1e6 / STATES * times["theirs"].median,
                "ratio": ratio.median,
                "lower quartile": ratio.lower,
                "upper quartile": ratio.upper,
            }


def _for_each(call: Callable[..., object], given: Sequence[tuple[object, ...]]) -> None:
    for arguments in given:
        call(*arguments)


ROBOTS = Check(
    key="robots",
    question="How long do M and B take, compared with Pinocchio?",
    cases=lambda _: FILES,
    row=time_robot,
    columns=Columns(timed=("ours", "Pinocchio", "ratio", "lower quartile", "upper quartile")),
)
