"""The stages of the evidence: stored once, read as they were; what fails costs one row or one
stage, and is named."""

import io
import math
import os
import subprocess
import sys
from dataclasses import replace
from functools import wraps
from pathlib import Path

import h5py
import numpy as np
import pytest

import verification.claims
from iapb.scene import find_scene, load_scene
from reports.commands import reproduce
from reports.evidence import depends, energy, gather, runs, topics
from reports.evidence import stage as stages
from reports.evidence.stage import Stage
from reports.evidence.topics import Plan
from reports.figures.figure import Recipe
from reports.pages.builder import build_report
from reports.pages.records import Evidence, FailedCases
from reports.provenance import linear_algebra
from reports.runner import Runner
from reports.store import keys
from reports.store.io import sealed
from tests.reports.made_up import flipped
from verification.claims import arm
from verification.finding import NOT_COMPUTED, VERDICTS, Finding, Part, failure_of, finding_of
from verification.laws import bulk
from verification.laws.topic import CAUGHT, COUNTEREXAMPLES, LAW_TABLE
from verification.scenes.books import OPEN
from verification.scenes.ledger import SCENES
from verification.table import Column, Columns, Table, table_from

ANY = (
    None,
    math.nan,
    -math.inf,
    -0.0,
    5e-324,
    2**70,
    True,
    "é",
    "nan",
    np.float32(0.5),
    np.bool_(True),
)
FINDING = finding_of(
    "mechanics",
    "Title",
    "Asked?",
    (Part("s", VERDICTS[0], name="p", held=1, decided=2, timed=True),),
    {
        "judged": Table(
            (
                Column("n", "N s"),
                Column("time", "s"),
                Column("said"),
            ),
            ((1, 0.5, "a"), (2, None, "b"), (3, math.inf, "c")),
            (True, None, False),
            3,
            "a note",
            Columns(("n",), timed=("time",), timed_rows=True),
        ),
        "empty": Table((Column("row"),)),
        "bare": Table(()),
    },
    answer="Answered.",
)


def nothing(*_):
    """No progress."""


def filled(folder, compute, kind=Finding, name="mechanics"):
    return Stage(folder / "tables", name, kind, "quick").fill(Runner(folder / "runs"), compute)


def test_records_are_computed_once_and_come_back_with_every_type(tmp_path):
    calls = []
    table = Table((Column("a/b", "m"), Column("row")), tuple((cell, 0) for cell in ANY))
    for kind, records in ((Finding, FINDING), (Table, table)):
        first, again = (
            filled(tmp_path, lambda _, own=records: calls.append(1) or own, kind, kind.__name__)
            for _ in range(2)
        )
        assert (
            repr(first.records)
            == repr(again.records)
            == repr(
                replace(records, rows=tuple((keys.plain(cell), 0) for cell in ANY))
                if kind is Table
                else records
            )
        )
    assert len(calls) == 2 and len(list((tmp_path / "tables").glob("*.h5"))) == 2


def test_a_stage_that_is_read_lists_the_runs_of_the_one_that_made_them(tmp_path):
    scene = load_scene(find_scene("peg_corner")).with_values({"duration": 0.4})

    def compute(failures):
        runner(scene, "IAPB")
        runner.user = "C07"
        runner(scene, "PB")
        runner.use_again(scene, "IAPB")
        return FINDING

    runner = Runner(tmp_path / "runs")
    made = Stage(tmp_path, "mechanics", Finding, "quick").fill(runner, compute)
    read = Stage(tmp_path, "mechanics", Finding, "quick").fill(
        Runner(tmp_path / "runs"), pytest.fail
    )
    assert made.runs == read.runs == runner.used
    assert [run.used_by for run in read.runs.values()] == [("mechanics", "C07"), ("C07",)]


def test_whatever_decides_the_records_is_in_the_name_of_their_file(tmp_path, monkeypatch):
    stages_of_claims = {topics.stage_of(claim) for claim in verification.claims.CLAIMS}
    assert stages_of_claims == set(topics.CLAIM_STAGES) <= set(topics.plans())
    monkeypatch.setattr(depends, "BESIDE", tmp_path)
    found = [depends.depends_of("complementarity")]
    case = tmp_path / "robots" / "case.txt"
    for name, text in (("case.txt", "one"), ("case.txt", "two"), ("renamed.txt", "two")):
        case.parent.mkdir(exist_ok=True)
        case.unlink(missing_ok=True)
        case = case.with_name(name)
        case.write_text(text)
        found.append(depends.depends_of("complementarity"))
        assert depends.depends_of("complementarity" + topics.AHEAD) == found[-1]
    made = [Stage(tmp_path, "a", int, "quick", one) for one in found]
    made += [Stage(tmp_path, "a", int, "full"), Stage(tmp_path, "b", int, "quick")]
    for name in ("evidence_version", "this_machine"):
        monkeypatch.setattr(stages, name, lambda: "another")
        made.append(Stage(tmp_path, "a", int, "quick"))
    assert len({stage.path for stage in made}) == len(made)
    monkeypatch.setattr(keys, "scene_folder", lambda: tmp_path / "scenes")
    monkeypatch.setattr(keys, "_ROOT", tmp_path)
    monkeypatch.setattr(keys, "sources_hash", lambda folder: folder)
    versions = [keys.evidence_version.__wrapped__()]
    for path in (tmp_path / "scenes" / "peg.yaml", tmp_path / "verification" / "case.xml"):
        path.parent.mkdir()
        path.write_text("name: peg")
        versions.append(keys.evidence_version.__wrapped__())
    assert len(set(versions)) == 3


def test_another_blas_kernel_is_another_machine_and_other_threads_are_not():
    """Asked of the library itself, as a user would choose another kernel."""
    if "openblas" not in linear_algebra():
        pytest.skip("numpy has another BLAS than OpenBLAS")
    program = "from reports.provenance import this_machine; print(this_machine())"
    said = [
        subprocess.run(
            [sys.executable, "-c", program],
            cwd=Path(__file__).parents[2],
            check=True,
            capture_output=True,
            env={**os.environ, "OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": threads},
        ).stdout
        for kernel, threads in (("Prescott", "2"), ("Haswell", "2"), ("Haswell", "1"))
    ]
    assert said[0] != said[1] == said[2]


def without_records(content):
    """A file whose seal holds and whose records are none."""
    stream = io.BytesIO(content)
    with h5py.File(stream, "r+") as file:
        del file["records"]
        file["records"] = 1
    return sealed(stream.getvalue())


def test_a_damaged_or_wrong_or_interrupted_stage_gives_no_records(tmp_path):
    def interrupted(failures):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        filled(tmp_path, interrupted)
    wrong = filled(tmp_path, lambda _: {"id": 3})  # what is computed must be what is read
    assert wrong.records is None and wrong.failures[0].error == "ValidationError"
    assert not list(tmp_path.rglob("tables/*.h5"))
    path = filled(tmp_path, lambda _: FINDING).path
    whole = path.read_bytes()
    for damage, said in ((flipped, ""), (without_records, "json is missing")):
        path.write_bytes(damage(whole))
        damaged = filled(tmp_path, lambda _: FINDING)
        assert damaged.records is None and damaged.failures[0].error.endswith("FileError")
        assert said in damaged.failures[0].reason


def test_a_stage_with_failures_is_computed_again_and_its_traceback_is_kept_until_then(tmp_path):
    def compute(failures):
        calls.append(1)
        if len(calls) == 1:
            failures.append(failure_of("two", ValueError("planted")))
        return ("one", "two")[: len(calls)]

    calls = []
    for expected in (("one",), ("one", "two"), ("one", "two")):
        stage = filled(tmp_path, compute, tuple[str, ...])
        failed = gather.failed_cases(tmp_path / "tables", {stage.name: stage.failures})
        assert (
            stage.records == expected
            and stage.path.is_file()
            and len(failed) == (len(expected) == 1)
        )
        assert not failed or "planted" in Path(failed[0].file).read_text()
    assert (
        len(calls) == 2
        and not list(tmp_path.rglob("*incomplete*"))
        and not list(tmp_path.rglob("*failed*"))
    )


def test_the_page_quotes_the_row_of_the_printed_formula_and_the_widest_scene():
    named = ("solver", "M", "J", "v⁻", "e", "v⁺", "relative energy gain")
    rows = {
        bulk.TABLE.key: [{"method": m, bulk.GAIN: m} for m in (bulk.NO_CLAMP, bulk.PRINTED)],
        LAW_TABLE.key: [{CAUGHT: True}],
        SCENES.key: [{"scene": str(x), OPEN: x} for x in (0.1, 0.3, 0.2)],
        COUNTEREXAMPLES.key: [dict.fromkeys(named, bulk.PRINTED)],
        energy.CERTIFIED_RUNS: [],
    }
    found = energy.numbers({key: table_from(given) for key, given in rows.items()})
    assert (found["printed_largest_gain"], found["widest_scene"]) == (bulk.PRINTED, "0.3")


def test_a_topic_that_fails_is_named_and_ctrl_c_is_no_failure(tmp_path, monkeypatch):
    raised = [RuntimeError, KeyboardInterrupt]

    def compute(*_):
        raise raised.pop(0)("the disk went away\nand more")

    monkeypatch.setattr(gather, "plans", lambda: {"survival": Plan(Finding, compute)})
    stage, again = (Stage(tmp_path / "tables", "survival", Finding, "quick") for _ in range(2))
    topic = gather._failed(gather._fill(stage, Runner(tmp_path / "runs"), "quick", nothing))
    assert topic.key == "survival" and [part.verdict for part in topic.parts] == [NOT_COMPUTED]
    page = build_report(Evidence(topics=(topic,)))["report/data.html"]
    assert "Not computed, after RuntimeError: the disk went away." in page
    with pytest.raises(KeyboardInterrupt):
        gather._fill(again, Runner(tmp_path / "runs"), "quick", nothing)


def broken(original, here):
    """`original`, which raises where `here` is true of its arguments."""

    @wraps(original)
    def call(*arguments, **options):
        if here(*arguments):
            raise ZeroDivisionError("planted")
        return original(*arguments, **options)

    return call


def test_a_trial_that_raises_costs_its_row_and_a_claim_its_verdict(monkeypatch, tmp_path):
    chosen = {name: verification.claims.CLAIMS[name] for name in ("C01", "C07")}
    chosen["C01"] = replace(chosen["C01"], cases=broken(chosen["C01"].cases, lambda study: True))
    monkeypatch.setattr(verification.claims, "CLAIMS", chosen)
    hit = (arm.PLACES[0], arm.ANGLES[0])
    strike = broken(arm.strike, lambda robot, place, angle, e: (place, angle) == hit)
    monkeypatch.setattr(arm, "strike", strike)
    failures = []
    first, second = topics.checked_claims("claims", Runner(tmp_path), "quick", nothing, failures)
    assert (first.verdict, first.tables["C01"].rows) == (NOT_COMPUTED, ())
    assert len(second.tables["C07"].rows) == 2 * len(arm.PLACES) * len(arm.ANGLES) - 2
    assert [failure.case for failure in failures] == [
        "C01",
        "C07, uniform rods, 0.0, 0.1",
        "C07, point masses at the ends of the links, 0.0, 0.1",
    ]


def test_a_run_of_a_figure_that_raises_leaves_the_others(monkeypatch, tmp_path):
    chosen = {name: runs.FIGURE_RUNS[name] for name in ("corner/IAPB", "device/IAPB")}
    monkeypatch.setattr(runs, "FIGURE_RUNS", chosen)
    fails = broken(runs.shipped_scene, lambda name, values: values)
    monkeypatch.setattr(runs, "shipped_scene", fails)
    failures = []
    assert list(runs.figure_runs(Runner(tmp_path), nothing, failures)) == ["corner/IAPB"]
    assert [failure.case for failure in failures] == ["device/IAPB"]


def test_the_last_lines_say_what_failed_and_where_the_traceback_is(monkeypatch, tmp_path):
    def fails():
        raise ValueError("planted")

    path = str(tmp_path / "tables" / "claims-failed.txt")
    failures = tuple(failure_of(f"C{n:02d}", ValueError("planted\nand more")) for n in range(1, 23))
    monkeypatch.setattr(reproduce, "RECIPES", (Recipe("hero", (), fails),))
    monkeypatch.setattr(
        reproduce, "gather", lambda *_: Evidence(failed=(FailedCases("claims", failures, path),))
    )
    answer = reproduce.make_report(tmp_path, "quick")
    assert answer.status == 1 and answer.facts["failed"][0] == FailedCases("claims", failures, path)
    said = "\n".join(answer.lines)
    assert "Not computed: 23 cases." in said and "claims: C01: ValueError: planted\n" in said
    assert f"tracebacks: {path}" in said and "figures: hero: ValueError: planted" in said
    assert "in fails" in (tmp_path / "tables" / "figures-failed.txt").read_text(encoding="utf-8")
    assert "C22: ValueError: planted" in (tmp_path / "report" / "data.html").read_text("utf-8")
