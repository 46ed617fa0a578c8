"""A sweep gives the same whatever interrupts it and whoever computes it."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from iapb import find_scene
from iapb.errors import ArgumentError, IapbError
from reports.batches import cluster, here, processes
from reports.store import read_table
from reports.sweeps.study import Point, points_of, study_from_text
from reports.sweeps.sweep import FAILED, RUNS, SUMMARY, SweepOutcome, compute_point, run_sweep
from tests.reports.sweeps.test_study import SMALL

SCENE, STUDY = str(find_scene("two_discs")), study_from_text(SMALL)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> SweepOutcome:
    return run_sweep(STUDY, SCENE, tmp_path_factory.mktemp("undisturbed"))


class Stopped(Exception):
    """Stands for whatever ends a process."""


def dying(compute: Callable[[Point], Any], points: Iterable[Point]) -> Iterator[tuple[Point, Any]]:
    """Compute backwards, and die after four points."""
    for done, found in enumerate(here(compute, reversed(list(points)))):
        if done == 4:
            raise Stopped
        yield found


def test_a_sweep_that_was_stopped_goes_on_and_a_finished_one_computes_nothing(
    undisturbed: SweepOutcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(Stopped):
        run_sweep(STUDY, SCENE, tmp_path, dying)  # type: ignore[arg-type]
    outcome = run_sweep(STUDY, SCENE, tmp_path)
    assert outcome.reused == 5  # the file of the one that was not kept is there
    assert outcome.content_hash == undisturbed.content_hash
    monkeypatch.setattr("reports.sweeps.sweep.simulate", lambda *_, **__: pytest.fail("simulated again"))
    again = run_sweep(STUDY, SCENE, tmp_path)
    assert (again.reused, again.content_hash) == (6, undisturbed.content_hash)
    assert again.points == undisturbed.points


def test_a_lost_file_is_computed_again_and_a_damaged_one_is_told(tmp_path: Path) -> None:
    first = run_sweep(STUDY, SCENE, tmp_path)
    lost, damaged = (first.folder / RUNS / point["file"] for point in first.points[:2])
    lost.unlink()
    content = damaged.read_bytes()
    damaged.write_bytes(content[:-100])
    outcome = run_sweep(STUDY, SCENE, tmp_path)
    assert outcome.reused == 4 and [damaged.name in point["note"] for point in outcome.failed] == [True]
    damaged.write_bytes(content)
    assert run_sweep(STUDY, SCENE, tmp_path).content_hash == first.content_hash


def test_other_values_give_another_hash_and_processes_and_a_cluster_the_same(
    undisturbed: SweepOutcome, tmp_path: Path
) -> None:
    other = study_from_text(SMALL.replace("seed: 3", "seed: 4"))
    assert run_sweep(other, SCENE, tmp_path / "other").content_hash != undisturbed.content_hash
    assert run_sweep(STUDY, SCENE, tmp_path / "two", processes(2)).content_hash == undisturbed.content_hash
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as local:
        outcome = run_sweep(STUDY, SCENE, tmp_path / "cluster", cluster(local.scheduler_address))
    assert outcome.content_hash == undisturbed.content_hash


def test_a_scheduler_that_dies_or_is_not_there_is_told_in_one_sentence(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with pytest.raises(ArgumentError, match="--scheduler"):
        run_sweep(STUDY, SCENE, tmp_path, cluster("nonsense://nowhere"))
    place, kept = tmp_path / "scheduler.json", 0
    tool, where = [sys.executable, "-m"], ["--scheduler-file", str(place), "--no-dashboard"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    master = subprocess.Popen([*tool, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *where],
                              **quiet)  # type: ignore[call-overload]
    worker = subprocess.Popen([*tool, "distributed.cli.dask_worker", *where, "--nthreads", "1", "--no-nanny"],
                              **quiet)  # type: ignore[call-overload]
    try:
        while not place.is_file():
            time.sleep(0.05)
        address = json.loads(place.read_text())["address"]
        with pytest.raises(IapbError, match="the scheduler at tcp://127.0.0.1:.* no longer answers; finished"):
            for _ in cluster(address)(time.sleep, [0.2] * 50):
                kept += 1
                master.kill()
    finally:
        for process in (master, worker):
            process.kill()
            process.wait()
    assert 1 <= kept < 50


def test_a_worker_of_another_version_does_not_take_part(tmp_path: Path) -> None:
    with pytest.raises(IapbError, match="another version"):
        compute_point(next(points_of(STUDY, SCENE)), str(tmp_path), "other code")


def test_a_point_that_cannot_be_run_is_told_and_the_others_are_done(tmp_path: Path) -> None:
    wrong = STUDY.model_copy(update={"grid": {"law.integrator": ("midpoint", "euler")}})
    outcome = run_sweep(wrong, SCENE, tmp_path)
    assert [point["status"] == FAILED for point in outcome.points] == [False] * 3 + [True] * 3
    assert "one of momentum, semi_implicit_euler" in outcome.failed[0]["note"]


def test_the_table_has_a_row_for_each_point(undisturbed: SweepOutcome) -> None:
    table = read_table(undisturbed.folder / SUMMARY, "small")
    assert table["file"] == [point["file"] for point in undisturbed.points]
    assert table["contact.restitution"] == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert table["energy_lost"][0] > 0.0 >= table["energy_lost"][-1] - 1e-12
