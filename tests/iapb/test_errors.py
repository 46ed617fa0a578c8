"""Errors cross processes, and offer the nearest name."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from iapb import errors
from iapb.names import nearest

ERRORS = [
    errors.ArgumentError("mass", -1.0, "at least 0 kg"),
    errors.ArgumentError("q", np.arange(3), "finite numbers"),
    errors.RangeError("energy", "too large"),
    errors.SceneError([errors.Mistake("peg.yaml", 3, 5, "bodies[0].mass", "-1", "at least 0 kg")]),
    errors.MissingDependencyError("mujoco", "This world", "pip install mujoco"),
    errors.RunFileError("damaged"),
    errors.SolverError("refused"),
]


def _all_children(kind: type[errors.IapbError]) -> set[type[errors.IapbError]]:
    return {kind}.union(*(_all_children(child) for child in kind.__subclasses__()))


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_survives_the_way_between_processes(error: errors.IapbError) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error) and str(copy) == str(error) and copy.args == error.args
    assert set(vars(copy)) == set(vars(error))
    assert repr(vars(copy)) == repr(vars(error))


def test_every_error_of_the_engine_is_tried() -> None:
    engine = {kind for kind in _all_children(errors.IapbError) if kind.__module__ == "iapb.errors"}
    assert {type(error) for error in ERRORS} == engine - {errors.IapbError}


def test_a_value_that_cannot_travel_travels_as_text() -> None:
    copy = pickle.loads(pickle.dumps(errors.ArgumentError("law", lambda: None, "a contact law")))
    assert copy.argument == "law" and "lambda" in copy.value and copy.expected == "a contact law"


SCENES = ("peg_corner", "peg_hole", "two_discs")


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("peg_cornr", "peg_corner"),
        ("PEG_HOLE", "peg_hole"),
        ("submarine", ""),
        (3, ""),
    ],
)
def test_the_nearest_name_is_found_whatever_its_capitals(wrong, right):
    assert nearest(wrong, SCENES) == right and nearest("iapb", ["ideal", "IAPB", "PB"]) == "IAPB"
