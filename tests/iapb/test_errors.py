"""Errors cross processes, and offer the nearest name."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from iapb.errors import (
    ArgumentError,
    IapbError,
    MissingDependencyError,
    Mistake,
    RangeError,
    RunFileError,
    SceneError,
    SolverError,
)
from iapb.names import nearest, one_of

ERRORS = [
    ArgumentError("mass", -1.0, "at least 0 kg"),
    ArgumentError("q", np.arange(3), "finite numbers"),
    RangeError("energy", "too large"),
    SceneError([Mistake("peg.yaml", 3, 5, "bodies[0].mass", "-1", "at least 0 kg")]),
    MissingDependencyError("drake", "This comparison", "pip install drake"),
    RunFileError("damaged"),
    SolverError("refused"),
]


def _all_children(kind: type[IapbError]) -> set[type[IapbError]]:
    return {kind}.union(*(_all_children(child) for child in kind.__subclasses__()))


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_survives_the_way_between_processes(error: IapbError) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert type(copy) is type(error) and str(copy) == str(error) and copy.args == error.args
    assert set(vars(copy)) == set(vars(error))
    assert repr(vars(copy)) == repr(vars(error))


def test_every_error_of_the_engine_is_tried() -> None:
    engine = {kind for kind in _all_children(IapbError) if kind.__module__ == "iapb.errors"}
    assert {type(error) for error in ERRORS} == engine - {IapbError}


def test_a_value_that_cannot_travel_travels_as_text() -> None:
    copy = pickle.loads(pickle.dumps(ArgumentError("law", lambda: None, "a contact law")))
    assert copy.argument == "law" and "lambda" in copy.value and copy.expected == "a contact law"


SCENES = ("peg_corner", "peg_hole", "two_discs")


@pytest.mark.parametrize(("wrong", "right"), [
    ("peg_cornr", "peg_corner"), ("PEG_HOLE", "peg_hole"), ("twodiscs", "two_discs"), ("submarine", ""), ("", ""),
    (3, ""), (None, ""),
])
def test_the_nearest_name_is_found_whatever_its_capitals(wrong, right):
    assert nearest(wrong, SCENES) == right


def test_all_names_are_listed_and_the_guess_comes_last():
    assert one_of("peg_cornr", SCENES) == "one of peg_corner, peg_hole, two_discs; did you mean peg_corner?"
    assert one_of("submarine", SCENES, "a file, or: ") == "a file, or: peg_corner, peg_hole, two_discs"


def test_a_guess_is_spelt_as_it_is_known():
    assert nearest("iapb", ["ideal", "IAPB", "PB"]) == "IAPB"
