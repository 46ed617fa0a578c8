"""Timings are records of solved impacts; a folder of problem files becomes lines, nothing left out in silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iapb.errors import ArgumentError
from reference.complementarity.problem import ImpactProblem
from reference.datasets import write_fclib
from verification.complementarity.findings import problems
from verification.complementarity.problems import FACTORS, study_problems
from verification.cost import step_cost
from verification.cost.calls import PRINTED
from verification.cost.step_cost import IAPB, KERNEL, LEMKE_KERNEL, impact_cost


def test_every_way_is_timed_on_every_size_and_gives_the_same_motion() -> None:
    costs = impact_cost((1, 3), ("daqp", "lemke"), repeats=1)
    assert set(costs.select(("impacts", "contacts", "solver")).rows) == {
        (family, contacts, solver) for family in ("patch", "pile") for contacts in (1, 3)
        for solver in (KERNEL, IAPB, PRINTED, LEMKE_KERNEL, "daqp", "lemke")
    }  # fmt: skip
    assert set(costs.column("outcome")) == {"solved"} and min(costs.column("samples")) >= 3
    assert all(row["least"] <= row["median"] <= row["largest"] for row in costs.records())


def test_a_wrong_answer_is_not_called_solved_and_a_slow_solver_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    original = step_cost.solver_call

    def wrong(case, name):  # type: ignore[no-untyped-def]
        return (lambda: case.velocity) if name == "lemke" else original(case, name)

    monkeypatch.setattr(step_cost, "solver_call", wrong)
    patch = impact_cost((1, 2), ("daqp", "lemke"), 1, longest=0.0).where(impacts="patch")
    assert patch.where(contacts=1, solver="lemke").column("outcome") == ["failed"]
    assert patch.where(contacts=2, solver="daqp").column("outcome") == ["left out"]


def test_a_folder_of_problems(tmp_path: Path) -> None:
    """A frictional, a frictionless asymmetric and a damaged file."""
    w = np.array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 1.0]])
    write_fclib(tmp_path / "one.hdf5", ImpactProblem.from_delassus(w, [-1.0, 0.2, 0.1], 0.0, 0.5))
    (tmp_path / "skew.lcp").write_text("2  2 1  0 2  -1 -1")
    (tmp_path / "damaged.lcp").write_text("3 1 2")
    (tmp_path / "readme.md").write_text("not a problem")
    told: list[tuple[str, int, int]] = []
    study = study_problems(tmp_path, progress=lambda *state: told.append(state))
    assert [done for stage, done, _ in told if stage.startswith("reading")] == [0, 1, 2]
    solving = [(done, total) for stage, done, total in told if stage.startswith("problems of")]
    assert solving == [(0, total := len(study.rows)), *((done, total) for done in range(total + 1))]
    assert [line.problem for line in study.lines] == ["one.hdf5", "skew.lcp"]
    assert [file.file for file in study.unread] == ["damaged.lcp"]
    assert study.lines[1].asymmetry > 0.1 and dict(study.lines[1].verdicts)["daqp"] == "refused"
    assert dict(study.lines[1].verdicts)["lemke"] == "solved"
    text = " ".join(part.sentence for part in problems(study))
    assert "1 files not" in text and "skew.lcp" in text
    assert "Files not readable: damaged.lcp: cannot be read: size 3 with 2 numbers" in text
    assert all(share.shape == FACTORS.shape and (np.diff(share) >= 0.0).all() for _, _, share in study.profile)
    with pytest.raises(ArgumentError, match="folder"):
        study_problems(tmp_path / "nowhere")
