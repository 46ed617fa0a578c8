"""Extensions, collections of problems, references: what their checks find, and that
planted rows turn it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.reference.fclib_files import local_file
from verification.check import Study
from verification.complementarity import extensions
from verification.complementarity.extensions import FRICTION, UNEQUAL
from verification.complementarity.of_runs import scene_impacts
from verification.complementarity.solvers import SCENES, collections
from verification.finding import REFUTED


def test_friction_is_coulombs_law_where_all_push_and_never_gains(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(extensions.COUNTS, "quick", 15)
    table = FRICTION.table(Study(), [(e, mu) for e in (0.0, 1.0) for mu in (0.2, 0.8)])
    plastic, elastic = (table.where(e=e).records() for e in (0.0, 1.0))
    assert sum(table["all contacts push"]) > 10 and table.passed
    assert all(row["NCP gains"] == 0 for row in plastic)
    assert any(row["NCP gains"] > 0 and row["friction reduced"] > 0 for row in elastic)
    for wrong in ({"equal to the NCP": -1}, {"largest change of KE, IAPB": 1e-9}):
        said = FRICTION.judge(FRICTION.table_of([plastic[0] | wrong]))
        assert [part.verdict for part in said].count(REFUTED) == 1


def test_unequal_restitution_is_poissons_law_and_never_gains() -> None:
    approaching, mixed = UNEQUAL.table(Study()).records()
    assert max(row["distance from Poisson's law"] for row in (approaching, mixed)) <= 1e-12
    assert max(row["largest change of KE, IAPB"] for row in (approaching, mixed)) <= 1e-12
    assert (
        approaching["Newton LCP"] <= 1e-12 < mixed["Newton LCP"] and approaching["equalities"] > 0.1
    )


@pytest.mark.parametrize("name", SCENES)
def test_each_scene_of_our_own_problems_has_an_impact_without_friction(name: str) -> None:
    assert scene_impacts(name)


def test_a_folder_of_problems(tmp_path: Path) -> None:
    """A frictional, a frictionless asymmetric and a damaged file."""
    w = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 1.0]])
    local_file(tmp_path / "one.hdf5", w, [-1.0, 0.2, 0.1], [0.5])
    (tmp_path / "skew.lcp").write_text("2  2 1  0 2  -1 -1")
    (tmp_path / "damaged.lcp").write_text("3 1 2")
    (tmp_path / "readme.md").write_text("not a problem")
    study = Study()
    (check,) = collections({"given": tmp_path})
    table = check.table(study)
    one, skew, damaged = table.records()
    assert (one["problem"], skew["problem"], damaged["problem"]) == (
        "one.hdf5",
        "skew.lcp",
        "damaged.lcp",
    )
    assert skew["asymmetry of W"] > 0.1 and (skew["daqp"], skew["lemke"]) == ("refused", "solved")
    assert damaged["daqp"] == "not read" and "size 3 with 2 numbers" in damaged["why not read"]
    assert check.judge(table)[0].verdict == REFUTED and table.holds == (True, True, False)
