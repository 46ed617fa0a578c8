"""Time of the mass matrix and the bias, per call and for many states in one call, compared with Pinocchio in Python.

Pinocchio is called in its fastest form, a bound function whose result is discarded. Both sides take turns, so that a
slow phase of the machine affects both; the study compares the ratio of each round.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_state
from reference.rigid_body import model_from_urdf
from verification.clock import seconds, take_turns
from verification.finding import Column, Failure, Table, check_depth, of_each, table_of
from verification.mechanics.against_pinocchio import SEED, robot_files

Floats = NDArray[np.float64]

LARGEST_RATIO = 3.0  # limit for one call; for a batch the limit is 1
STATES = 200  # random states, one call each, in one round
ROUNDS = {"quick": 25, "full": 200}
COLUMNS = (
    Column("robot", condition=True),
    Column("velocities", condition=True),
    Column("quantity", condition=True),
    Column("form", condition=True),
    Column("time", "µs per state"),
    Column("Pinocchio", "µs per state"),
    Column("ratio"),
    Column("lower quartile"),
    Column("upper quartile"),
)
ONE, MANY = "one state per call", f"{STATES} states in one call"


def time_robots(
    folder: str | Path | None = None, depth: str = "quick", failures: list[Failure] | None = None
) -> Table:
    """Time every URDF file of a folder (default `shared/robots` beside the checkout)."""
    check_depth(depth)
    files, skipped = robot_files(folder)
    table = table_of(COLUMNS, of_each(files, lambda path: _rows(path, ROUNDS[depth]), failures,
                                      lambda path: path.stem))
    statement = (
        "M and B cost little more per call from Python than Pinocchio's, and less for many states at once."
    )
    tolerance = (
        f"median ratio at most {LARGEST_RATIO:g} per call, below 1 for many states; rounds interleaved"
    )
    return replace(_judged(table), note=skipped or f"{statement} Tolerance: {tolerance}.")


def _rows(path: Path, rounds: int) -> Iterator[dict[str, Any]]:
    mechanism = Mechanism.from_urdf(path)
    rng = np.random.default_rng(SEED)
    states = [random_state(rng, mechanism) for _ in range(STATES)]
    head = {"robot": path.stem, "velocities": mechanism.nv}
    for quantity, form, ours, theirs in _contests(mechanism, path, states):
        times = take_turns({"ours": partial(seconds, ours), "theirs": partial(seconds, theirs)}, rounds)
        per_state, ratio = 1e6 / STATES, times["ours"].over(times["theirs"])
        yield {**head, "quantity": quantity, "form": form, "time": per_state * times["ours"].median,
               "Pinocchio": per_state * times["theirs"].median, "ratio": ratio.median,
               "lower quartile": ratio.lower, "upper quartile": ratio.upper}  # fmt: skip


def _contests(
    mechanism: Mechanism, path: Path, states: list[tuple[Floats, Floats]]
) -> Iterator[tuple[str, str, Callable[[], object], Callable[[], object]]]:
    """Yield the quantity, the form of the call, and the two functions that do the work on all states."""
    qs, vs = (np.array(rows) for rows in zip(*states, strict=True))
    their_mass, their_bias = model_from_urdf(path).calls()

    def masses() -> None:
        for q, _ in states:
            mechanism.mass_matrix(q)

    def biases() -> None:
        for q, v in states:
            mechanism.bias(q, v)

    def their_masses() -> None:
        for q, _ in states:
            their_mass(q)

    def their_biases() -> None:
        for q, v in states:
            their_bias(q, v)

    yield "mass matrix", ONE, masses, their_masses
    yield "bias", ONE, biases, their_biases
    yield "mass matrix", MANY, lambda: mechanism.mass_matrices(qs), their_masses
    yield "bias", MANY, lambda: mechanism.biases(qs, vs), their_biases


def _judged(table: Table) -> Table:
    holds = (row["ratio"] < (1.0 if row["form"] == MANY else LARGEST_RATIO) for row in table.records())
    return replace(table, holds=tuple(holds))
