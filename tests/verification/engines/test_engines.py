"""Records of engines: measures see planted faults, verdicts and sentences follow from the records."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb.errors import MissingDependencyError
from reference.simulators import find_simulator, fixed_scene
from verification import engines
from verification.engines import ERRORS, compare_engines, measured, row_of, verdict
from verification.finding import NOT_TESTABLE, REPRODUCED, verdict_of


def judged(records):
    table = ERRORS.table_of(map(row_of, records))
    parts = ERRORS.sentences(table)
    return parts, engines.engines.says({"errors": table}, parts)


@pytest.fixture(scope="module")
def wedge():
    scene = fixed_scene("redundant_wedge")
    rigid = find_simulator("rigid")
    settings = rigid.settings(scene)
    return scene, rigid.run(scene, settings, settings.step, scene.duration)


def test_our_engine_meets_the_law_of_the_wedge():
    records = compare_engines(["iapb", "rigid"], ["redundant_wedge"])
    assert [verdict(record) for record in records] == ["met"] * 4
    assert max(abs(record.measures["energy error"]) for record in records) < 1e-12
    assert {record.choice for record in records} == {"own", "matched"}
    assert all("step 1 ms" in record.settings for record in records)


def test_a_faster_end_is_an_energy_gain_and_a_miss(wedge, monkeypatch):
    scene, motion = wedge
    velocity = motion.velocity.copy()
    velocity[-1] *= 1.1
    fault = measured(scene, replace(motion, velocity=velocity))
    assert measured(scene, motion)["energy error"] == pytest.approx(0.0, abs=1e-12)
    assert fault["energy error"] == pytest.approx(0.21, rel=1e-9)
    assert fault["largest rise of energy"] == pytest.approx(0.21, rel=1e-9)
    assert fault["momentum error"] == pytest.approx(0.1, rel=1e-9)
    velocity[20:] = np.nan
    monkeypatch.setattr(type(find_simulator("rigid")), "run", lambda *_: replace(motion, velocity=velocity))
    assert "not a number from" in compare_engines(["rigid"], ["redundant_wedge"])[0].failure


def test_an_engine_that_is_absent_is_named_and_not_left_out(monkeypatch):
    class Absent:
        title = "Absent"

        def version(self):
            raise MissingDependencyError("absent", "The adapter", "pip install absent")

    present = compare_engines(["iapb"], ["redundant_wedge"])
    monkeypatch.setattr(engines, "find_simulator", lambda name: Absent())
    records = compare_engines(["mujoco"], ["resting_box"])
    assert [verdict(record) for record in records] == ["not installed"] * 2
    assert all("pip install absent" in record.missing for record in records)
    parts, _ = judged([*present, *records])
    assert (parts[-1].verdict, verdict_of(parts)) == (NOT_TESTABLE, REPRODUCED)
    assert "Absent" in parts[-1].sentence


def breaks(*_):
    raise RuntimeError("it broke")


def test_another_engine_that_stops_is_a_result_and_our_own_a_failure(monkeypatch):
    monkeypatch.setattr(type(find_simulator("pinocchio")), "run", breaks)
    monkeypatch.setattr(type(find_simulator("rigid")), "run", breaks)
    failures = []
    records = compare_engines(["pinocchio", "rigid"], ["bernoulli"], failures=failures)
    assert {(record.engine, verdict(record)) for record in records} == {("pinocchio", "failed")}
    assert "it broke" in judged(records)[0][0].sentence
    assert [(one.case, one.reason) for one in failures] == [("rigid on bernoulli", "it broke")]


def test_the_answer_names_every_miss_ours_first():
    """"31 of 32" hid that the one miss was ours, by 97 m."""
    (ours, _) = compare_engines(["iapb"], ["redundant_wedge"])
    moved = replace(ours, measures={"drift [m]": 97.0, "creep [m]": 60.0}, scene="heavy_stack")
    other = replace(ours, engine="other", title="Another", measures={"drift [m]": 0.24}, choice="matched")
    _, answer = judged([other, moved])
    assert answer.endswith("Wrong: iapb (ours), heavy stack (thrown out) with settings that suit it; "
                           "Another, redundant wedge (moves by 0.24 m) at a step of 1 ms.")
    assert (row_of(moved)["drift [m]"], row_of(moved)["creep [m]"], row_of(moved)["law"]) == (None, None, "missed")
    assert "Wrong" not in judged([ours])[1]
