"""What a study may say; a sweep gives the same whatever interrupts it and whoever computes it."""

import json
import math
import subprocess
import sys
import time

import pytest

from iapb import find_scene, load_scene
from iapb.errors import ArgumentError, IapbError, SceneError
from reports.batches import cluster, here, processes
from reports.store import read_run, read_table
from reports.sweeps import study as studies
from reports.sweeps.study import (
    MAX_POINTS,
    Range,
    find_study,
    load_study,
    points_of,
    scene_of,
    study_from_text,
)
from reports.sweeps.sweep import FAILED, RUNS, SUMMARY, compute_point, run_sweep

SMALL = """\
name: small
scene: two_discs
values: {duration: 0.06, bodies.striker.position.0: -0.06}
grid:
  contact.restitution: [0, 1]
random: {count: 3, seed: 3, values: {bodies.striker.velocity.1: {from: -0.1, to: 0.1}}}
"""
SCENE, STUDY = str(find_scene("two_discs")), study_from_text(SMALL)


def test_every_combination_of_world_grid_and_draw_is_a_point_and_more_draws_change_none_of_those_before():
    study = study_from_text(SMALL.replace("grid:", "grid:\n  law.integrator: [midpoint]"))
    points = list(points_of(study, "two_discs"))
    assert len(points) == study.size == 6 and [point.index for point in points] == list(range(6))
    assert {point.values["contact.restitution"] for point in points} == {0, 1}
    assert all(point.values["duration"] == 0.06 for point in points)
    assert points[0].law == {"integrator": "midpoint"} and "law.integrator" not in points[0].values
    one = SMALL.replace("[0, 1]", "[1]")
    few, many, other = ([point.values for point in points_of(study_from_text(text), "s")] for text in (
        one, one.replace("count: 3", "count: 9"), one.replace("seed: 3", "seed: 4")))
    assert many[:3] == few and many[3] not in few and not any(values in few for values in other)


@pytest.mark.parametrize(("start", "stop", "scale"), [
    (0.1, 1e3, "linear"), (0.1, 1e3, "log"), (1e9, 1e-320, "log"), (1e-320, 1e9, "log")])
def test_a_range_has_its_ends_exactly_and_even_steps(start, stop, scale):
    values = Range.model_validate({"from": start, "to": stop, "count": 5, "scale": scale}).values()
    assert (values[0], values[-1], len(values)) == (start, stop, 5)
    places = values if scale == "linear" else [math.log(value) for value in values]
    steps = [b - a for a, b in zip(places, places[1:], strict=False)]
    assert max(steps) == pytest.approx(min(steps), rel=1e-9 if 1e-300 < min(values) else 1e-4)  # fewer digits there


@pytest.mark.parametrize(("old", "new", "said"), [
    *((f"{name}:", f"{name}x:", f"{name}x") for name in ("values", "grid", "random", "count", "seed", "from", "to")),
    ("count: 3", "count: 0", "random.count"),
    ("count: 3", f"count: {MAX_POINTS}", "at most"),
    ("[0, 1]", "{from: 0, to: 1, count: 3, scale: log}", "linear where an end is not positive"),
    ("{from: -0.1, to: 0.1}", "{from: 1, to: 0.1}", "at least 1"),
])  # fmt: skip
def test_a_mistake_is_told_with_its_place(old, new, said):
    with pytest.raises(SceneError, match=said):
        study_from_text(SMALL.replace(old, new), "file.yaml")


def test_each_study_that_comes_with_the_project_can_be_run_and_what_is_not_there_is_refused_by_name(tmp_path):
    """Among them a name longer than any file's (found by wrong input), and links that lead in a circle."""
    for name in studies.study_names():
        study = load_study(find_study(name))
        scene = load_scene(scene_of(study, find_study(name)))
        assert scene.with_values(next(points_of(study, scene.name)).values).name == scene.name
    (tmp_path / "a.yaml").symlink_to("b.yaml")
    (tmp_path / "b.yaml").symlink_to("a.yaml")
    (tmp_path.with_name("outside")).write_text("")
    (tmp_path / "link").symlink_to(tmp_path.with_name("outside"))
    for scene in ("9" * 1000 + ".yaml", "a.yaml", "link", "../outside", "/etc/passwd", "a\0b"):
        with pytest.raises(ArgumentError, match="scene = "):
            scene_of(STUDY.model_copy(update={"scene": scene}), tmp_path / "study.yaml")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return run_sweep(STUDY, SCENE, tmp_path_factory.mktemp("undisturbed"))


class Stopped(Exception):
    """Stands for whatever ends a process."""


def dying(compute, points):
    """Compute backwards, and die after four points."""
    for done, found in enumerate(here(compute, reversed(list(points)))):
        if done == 4:
            raise Stopped
        yield found


def test_a_sweep_that_was_stopped_goes_on_and_a_finished_one_computes_nothing(undisturbed, tmp_path, monkeypatch):
    with pytest.raises(Stopped):
        run_sweep(STUDY, SCENE, tmp_path, dying)
    outcome = run_sweep(STUDY, SCENE, tmp_path)
    assert outcome.reused == 5  # the file of the one that was not kept is there
    assert outcome.content_hash == undisturbed.content_hash
    table = read_table(outcome.folder / SUMMARY, "small")
    assert table["file"] == [point["file"] for point in outcome.points]
    assert table["contact.restitution"] == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
    assert table["energy_lost"][0] > 0.0 >= table["energy_lost"][-1] - 1e-12
    with monkeypatch.context() as patch:
        patch.setattr("reports.sweeps.sweep.simulate", lambda *_, **__: pytest.fail("simulated again"))
        again = run_sweep(STUDY, SCENE, tmp_path)
    assert (again.reused, again.content_hash, again.points) == (6, undisturbed.content_hash, undisturbed.points)
    lost, damaged = (outcome.folder / RUNS / point["file"] for point in outcome.points[:2])
    lost.unlink()
    content = damaged.read_bytes()
    damaged.write_bytes(content[:-100])
    outcome = run_sweep(STUDY, SCENE, tmp_path)
    assert outcome.reused == 4 and [damaged.name in point["note"] for point in outcome.failed] == [True]
    damaged.write_bytes(content)
    assert run_sweep(STUDY, SCENE, tmp_path).content_hash == undisturbed.content_hash


def test_the_kinetic_energy_of_a_point_is_that_of_its_end(undisturbed):
    point = undisturbed.points[0]
    kinetic = read_run(undisturbed.folder / RUNS / point["file"]).energy["kinetic"]
    assert point["kinetic_energy [J]"] == kinetic[-1] < kinetic[0]


def test_other_values_give_another_hash_and_processes_and_a_cluster_the_same(undisturbed, tmp_path):
    other = study_from_text(SMALL.replace("seed: 3", "seed: 4"))
    assert run_sweep(other, SCENE, tmp_path / "other").content_hash != undisturbed.content_hash
    assert run_sweep(STUDY, SCENE, tmp_path / "two", processes(2)).content_hash == undisturbed.content_hash
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as local:
        outcome = run_sweep(STUDY, SCENE, tmp_path / "cluster", cluster(local.scheduler_address))
    assert outcome.content_hash == undisturbed.content_hash


def test_a_scheduler_that_dies_or_is_not_there_is_told_in_one_sentence(tmp_path):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with pytest.raises(ArgumentError, match="--scheduler"):
        run_sweep(STUDY, SCENE, tmp_path, cluster("nonsense://nowhere"))
    place, kept = tmp_path / "scheduler.json", 0
    where = ["--scheduler-file", str(place), "--no-dashboard"]
    master, worker = (subprocess.Popen([sys.executable, "-m", f"distributed.cli.dask_{kind}", *where, *more],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                      for kind, more in (("scheduler", ["--host", "127.0.0.1", "--port", "0"]),
                                         ("worker", ["--nthreads", "1", "--no-nanny"])))  # fmt: skip
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


def test_a_worker_of_another_version_and_a_point_that_cannot_be_run_are_told_and_the_others_are_done(tmp_path):
    with pytest.raises(IapbError, match="another version"):
        compute_point(next(points_of(STUDY, SCENE)), str(tmp_path), "other code")
    wrong = STUDY.model_copy(update={"grid": {"law.integrator": ("midpoint", "euler")}})
    outcome = run_sweep(wrong, SCENE, tmp_path)
    assert [point["status"] == FAILED for point in outcome.points] == [False] * 3 + [True] * 3
    assert "one of momentum, semi_implicit_euler" in outcome.failed[0]["note"]
