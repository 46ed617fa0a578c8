"""A stage: records go to a file once, come back as they were, and their tables can be read by anybody."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from iapb.errors import RunFileError
from iapb.scene import find_scene, load_scene
from reports.evidence import depends
from reports.evidence import stage as stages
from reports.evidence.stage import Stage
from reports.provenance import UNKNOWN, dispatched, linear_algebra, this_machine
from reports.runner import Runner
from reports.store import keys
from verification.finding import VERDICTS, Failure, Finding, Part, finding_of
from verification.table import Column, Table, titled


@dataclass(frozen=True)
class Record:
    """A record as the stages have them."""

    key: str
    value: float
    holds: bool
    note: str | None = None
    numbers: Table | None = None


TABLE = titled(("scene", "time [s]", "gain", "holds"), (("peg", 0.25, None, True), ("arm", 1.5, 1e-16, False)),
                note="of the peg")  # fmt: skip
RECORDS = (Record("C01", 1.5, True, "é", TABLE), Record("C02", math.inf, False), Record("C03", math.nan, False))


def same(first, second):
    return repr(first) == repr(second)


def test_records_come_back_as_they_were_and_are_computed_once(tmp_path):
    calls = []

    def compute():
        calls.append(1)
        return RECORDS

    for _ in range(2):
        found = Stage(tmp_path, "claims", tuple[Record, ...], {"depth": "quick"}).get_or_compute(compute)
        assert same(found, RECORDS), found  # infinities and missing numbers included
    assert len(calls) == 1 and len(list(tmp_path.glob("*.h5"))) == 1


def test_numpy_values_become_plain_ones(tmp_path):
    record = Record("C04", np.float64(0.1), np.bool_(True), None, titled(("n",), ((np.int64(3),), (np.float32(0.5),))))
    stage = Stage(tmp_path, "one", Record, {})
    [computed, read] = [stage.get_or_compute(lambda: record) for _ in range(2)]
    assert same(computed, read) and type(read.value) is float and type(read.holds) is bool
    assert keys.plain({"a": (np.int64(1),)}) == {"a": [1]}


def test_runs_are_remembered_beside_the_records(tmp_path):
    """A stage that is read from its file lists the same runs as the one that made them."""
    scene = load_scene(find_scene("peg_corner")).with_values({"duration": 0.4})

    def compute(runner):
        runner(scene, "IAPB")
        runner.user = "C07"
        runner(scene, "PB")
        return RECORDS

    seen = []
    for _ in range(2):
        runner, stage = Runner(tmp_path / "runs"), Stage(tmp_path, "claims", tuple[Record, ...], {})
        stage.get_or_compute(lambda: compute(runner), runner)  # noqa: B023
        assert runner.used == stage.runs
        seen.append(stage.runs)
    assert seen[0] == seen[1] and [run.used_by for run in seen[0].values()] == [("claims",), ("C07",)]
    wanted = [f"iapb run peg_corner --set duration=0.4 --world {w}" for w in ("IAPB", "PB")]
    assert [run.command for run in stage.runs.values()] == wanted


def test_what_a_stage_reads_beside_the_project_is_in_its_key(tmp_path, monkeypatch):
    monkeypatch.setattr(depends, "BESIDE", tmp_path)
    found = [depends.depends_of("complementarity")]
    for text in ("one", "two"):
        (tmp_path / "problems").mkdir(exist_ok=True)
        (tmp_path / "problems" / "case.txt").write_text(text)
        found.append(depends.depends_of("complementarity"))
    assert len({Stage(tmp_path, "complementarity", int, {}, one).path for one in found}) == 3
    assert found[0]["problems"] == depends.ABSENT and "cvxpy" in found[0]
    assert depends.depends_of("properties") == {}
    assert set(depends.depends_of("proofs")) == {"Coq", "coq", "statements"}  # a version, and hashes of texts
    assert set(depends.depends_of("engines")) >= {"mujoco", "drake"}


def test_a_changed_scene_is_another_key(tmp_path, monkeypatch):
    (tmp_path / "peg.yaml").write_text("name: peg")
    monkeypatch.setattr("reports.store.keys.scene_folder", lambda: tmp_path)
    versions = [keys.evidence_version.__wrapped__()]
    (tmp_path / "peg.yaml").write_text("name: pig")
    versions.append(keys.evidence_version.__wrapped__())
    assert versions[0] != versions[1]


def test_another_depth_name_or_source_is_another_file(tmp_path, monkeypatch):
    made = [Stage(tmp_path, "a", int, {"depth": "quick"}), Stage(tmp_path, "a", int, {"depth": "full"}),
            Stage(tmp_path, "b", int, {"depth": "quick"})]  # fmt: skip
    monkeypatch.setattr(stages, "evidence_version", lambda: "another line of code")
    made.append(Stage(tmp_path, "a", int, {"depth": "quick"}))
    monkeypatch.setattr(stages, "this_machine", lambda: "another processor")
    made.append(Stage(tmp_path, "a", int, {"depth": "quick"}))
    assert len({stage.path for stage in made}) == 5


def test_another_blas_kernel_is_another_machine_and_another_number_of_threads_is_not():
    """Asked of OpenBLAS itself, as a user would choose another kernel."""
    if "openblas" not in linear_algebra():
        pytest.skip("numpy has another BLAS than OpenBLAS, whose kernels this asks for")
    program = "from reports.provenance import this_machine; print(this_machine())"
    said = []
    for chosen in ({"OPENBLAS_CORETYPE": "Prescott"}, {"OPENBLAS_CORETYPE": "Haswell"},
                   {"OPENBLAS_CORETYPE": "Haswell", "OPENBLAS_NUM_THREADS": "1"}):  # fmt: skip
        done = subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], text=True, check=True,
                              capture_output=True, env={**os.environ, **chosen})  # fmt: skip
        said.append(done.stdout.strip())
    assert said[0] != said[1] == said[2]


def test_numpy_without_its_optional_code_is_another_machine():
    if dispatched() in (UNKNOWN, "baseline"):
        pytest.skip("numpy has no optional code for this processor")
    program = "from reports.provenance import this_machine; print(this_machine())"
    done = subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[2], text=True, check=True,
                          capture_output=True,
                          env={**os.environ, "NPY_DISABLE_CPU_FEATURES": dispatched()})  # fmt: skip
    assert done.stdout.strip() == this_machine().replace(f"numpy {dispatched()}", "numpy baseline")


def test_a_stage_that_fails_or_is_interrupted_leaves_nothing(tmp_path):
    def interrupted():
        raise KeyboardInterrupt

    stage = Stage(tmp_path, "a", Record, {})
    with pytest.raises(KeyboardInterrupt):
        stage.get_or_compute(interrupted)
    with pytest.raises(ValueError, match="Record"):
        stage.get_or_compute(lambda: {"id": 3})  # what is computed must be what is read
    assert not list(tmp_path.iterdir())
    assert stage.get_or_compute(lambda: RECORDS[0]) == RECORDS[0]


def test_a_damaged_file_is_an_error_not_a_result(tmp_path):
    stage = Stage(tmp_path, "a", Record, {})
    stage.get_or_compute(lambda: RECORDS[0])
    content = bytearray(stage.path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    stage.path.write_bytes(bytes(content))
    with pytest.raises(RunFileError):
        stage.get_or_compute(lambda: RECORDS[0])


ANY = (None, math.nan, math.inf, -math.inf, -0.0, 0.1, 5e-324, 3, -(2**53) - 1, 2**70, True, False,
       "", "é", "nan", "True", "None")  # fmt: skip


def test_every_cell_comes_back_with_its_type(tmp_path):
    table = Table((Column("a/b", "m"), Column("row")), tuple((cell, 0) for cell in ANY))
    [_, read] = [Stage(tmp_path, "one", Table, {}).get_or_compute(lambda: table) for _ in range(2)]
    assert same(read, table)


def test_a_finding_comes_back_equal_in_every_field(tmp_path):
    flags = (Column("n", "N s", condition=True, part=True), Column("time", "s", timed=True),
             Column("said", prose=True))  # fmt: skip
    judged = Table(flags, ((1, 0.5, "a"), (2, None, "b"), (3, math.inf, "c")), (True, None, False), 3, "a note", True)
    parts = (Part("s", VERDICTS[0], name="p", held=1, decided=2, fails="x", timed=True),)
    made = finding_of("mechanics", "Title", "Asked?", "Answered.", parts,
                      {"judged": judged, "empty": Table(flags), "bare": Table(())}, [Failure("c", "E", "why", "where")])
    stage = Stage(tmp_path, "mechanics", Finding, {})
    [computed, read] = [stage.get_or_compute(lambda: made) for _ in range(2)]
    assert same(computed, read) and same(read.tables["judged"], judged) and read == made
    assert stage.path.name.endswith("-incomplete.h5")  # it has a case that failed
