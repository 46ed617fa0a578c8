"""A sweep gives the same whatever interrupts it and whoever computes it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from iapb import find_scene
from iapb.errors import ArgumentError, IapbError
from reports.batches import cluster, do_missing, here, processes
from reports.store.tables import read_table
from reports.sweeps.study import Point, Study, study_from_text
from reports.sweeps.sweep import (
    FAILED,
    RUNS,
    SUMMARY,
    Result,
    SweepOutcome,
    compute_point,
    run_sweep,
)

SCENE = str(find_scene("two_discs"))


@pytest.fixture
def undisturbed(study: Study, tmp_path: Path) -> SweepOutcome:
    return run_sweep(study, SCENE, tmp_path / "undisturbed")


class Stopped(Exception):
    """Stands for whatever ends a process."""


def stopping_after(count: int):  # type: ignore[no-untyped-def]
    """A scheduler that computes backwards and dies after `count` points."""

    def schedule(compute: Callable[[Point], Result], points: Iterable[Point]) -> Iterator[tuple[Point, Result]]:
        for done, found in enumerate(here(compute, reversed(list(points)))):
            if done == count:
                raise Stopped
            yield found

    return schedule


def test_a_sweep_that_was_stopped_goes_on_and_ends_alike(
    study: Study, undisturbed: SweepOutcome, tmp_path: Path
) -> None:
    with pytest.raises(Stopped):
        run_sweep(study, SCENE, tmp_path, stopping_after(4))
    outcome = run_sweep(study, SCENE, tmp_path)
    assert outcome.reused == 5  # the file of the one that was not kept is there
    assert outcome.content_hash == undisturbed.content_hash
    assert [r.file for r in outcome.results] == [r.file for r in undisturbed.results]


def test_a_finished_sweep_computes_nothing(
    study: Study, undisturbed: SweepOutcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("reports.sweeps.sweep.simulate", lambda *_, **__: pytest.fail("simulated again"))
    again = run_sweep(study, SCENE, undisturbed.folder.parent)
    assert (again.reused, again.content_hash) == (6, undisturbed.content_hash)
    assert [replace(result, reused=False) for result in again.results] == list(undisturbed.results)


def test_a_lost_file_is_computed_again_and_a_damaged_one_is_told(study: Study, undisturbed: SweepOutcome) -> None:
    lost, damaged = (undisturbed.folder / RUNS / result.file for result in undisturbed.results[:2])
    lost.unlink()
    content = damaged.read_bytes()
    damaged.write_bytes(content[:-100])
    outcome = run_sweep(study, SCENE, undisturbed.folder.parent)
    assert outcome.reused == 4 and [damaged.name in result.note for result in outcome.failed] == [True]
    damaged.write_bytes(content)
    assert run_sweep(study, SCENE, undisturbed.folder.parent).content_hash == undisturbed.content_hash


def test_other_values_give_another_hash(text: str, undisturbed: SweepOutcome, tmp_path: Path) -> None:
    other = run_sweep(study_from_text(text.replace("seed: 3", "seed: 4")), SCENE, tmp_path)
    assert other.content_hash != undisturbed.content_hash


def test_processes_give_the_same(study: Study, undisturbed: SweepOutcome, tmp_path: Path) -> None:
    assert run_sweep(study, SCENE, tmp_path, processes(2)).content_hash == undisturbed.content_hash


def test_a_dask_cluster_gives_the_same(study: Study, undisturbed: SweepOutcome, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as local:
        outcome = run_sweep(study, SCENE, tmp_path, cluster(local.scheduler_address))
    assert outcome.content_hash == undisturbed.content_hash


def test_a_scheduler_that_dies_is_told_in_one_sentence_and_what_was_done_is_kept(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    place = tmp_path / "scheduler.json"
    tool, where = [sys.executable, "-m"], ["--scheduler-file", str(place), "--no-dashboard"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    master = subprocess.Popen([*tool, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *where],
                              **quiet)  # type: ignore[call-overload]
    worker = subprocess.Popen([*tool, "distributed.cli.dask_worker", *where, "--nthreads", "1", "--no-nanny"],
                              **quiet)  # type: ignore[call-overload]
    kept: list[float] = []

    def keep(part: float, _: None) -> None:
        kept.append(part)
        master.kill()

    try:
        while not place.is_file():
            time.sleep(0.05)
        address = json.loads(place.read_text())["address"]
        with pytest.raises(IapbError, match="the scheduler at tcp://127.0.0.1:.* no longer answers; finished"):
            do_missing([0.2] * 50, time.sleep, keep, done=lambda part: False, scheduler=cluster(address),
                       progress=lambda done, total: None)  # fmt: skip
    finally:
        for process in (master, worker):
            process.kill()
            process.wait()
    assert 1 <= len(kept) < 50


def test_an_address_where_nobody_answers_is_refused(study: Study, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with pytest.raises(ArgumentError, match="--scheduler"):
        run_sweep(study, SCENE, tmp_path, cluster("nonsense://nowhere"))


def test_a_worker_of_another_version_does_not_take_part(study: Study, tmp_path: Path) -> None:
    from reports.sweeps.study import points_of

    with pytest.raises(IapbError, match="another version"):
        compute_point(next(points_of(study, SCENE)), str(tmp_path), "other code")


def test_a_point_that_cannot_be_run_is_told_and_the_others_are_done(study: Study, tmp_path: Path) -> None:
    wrong = study.model_copy(update={"grid": {"law.integrator": ("midpoint", "euler")}})
    outcome = run_sweep(wrong, SCENE, tmp_path)
    assert [result.status == FAILED for result in outcome.results] == [False] * 3 + [True] * 3
    assert "one of momentum, semi_implicit_euler" in outcome.failed[0].note


def test_the_table_has_a_row_for_each_point(undisturbed: SweepOutcome) -> None:
    table = read_table(undisturbed.folder / SUMMARY, "small")
    assert list(table["file"]) == [result.file for result in undisturbed.results]
    assert list(table["contact.restitution"]) == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert table["energy_lost"][0] > 0.0 >= table["energy_lost"][-1] - 1e-12


def test_a_killed_command_goes_on_and_ends_alike(text: str, undisturbed: SweepOutcome, tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(text)
    command = [sys.executable, "-m", "reports.cli", "sweep", str(tmp_path / "small.yaml"), "--workers", "1",
               "--out", str(tmp_path / "out")]
    runs = tmp_path / "out" / "small" / RUNS
    killed = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    while killed.poll() is None and not list(runs.glob("*.h5")):
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    again = subprocess.run(command, capture_output=True, text=True, check=True)
    assert f"All results together: {undisturbed.content_hash[:16]}" in again.stdout
