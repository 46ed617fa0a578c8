"""Sweeps: finished points stay, the missing ones are computed, a failed one costs its row; all
executors agree."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
import xarray

from iapb.errors import ArgumentError, IapbError, SceneError
from iapb.scene import find_scene, load_scene, scene_names
from reports.cli import main
from reports.store import read_run
from reports.store.keys import code_version
from reports.sweep import load_study, simulate_point
from reports.workers import executor

STUDY = """\
scene: two_discs
worlds: [IAPB, PB]
values:
  duration: [0.06]
  bodies.striker.position.0: [-0.06]
  contact.restitution: [0, 1]
  bodies.striker.velocity.1: [-0.1, 0.1]
"""
ROOT = Path(__file__).parents[2]
ONE_THREAD = {  # a cluster in this process
    "n_workers": 1,
    "threads_per_worker": 1,
    "processes": False,
    "memory_limit": None,  # of the process of the tests, which counts as a worker's
    "dashboard_address": None,
    "protocol": "tcp",
}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder of a finished sweep."""
    folder = tmp_path_factory.mktemp("done")
    (folder / "small.yaml").write_text(STUDY)
    assert sweep(folder) == 0
    return folder


def sweep(folder, *options):
    return main(
        ["sweep", str(folder / "small.yaml"), "--workers", "1", "--out", str(folder), *options]
    )


def table(folder):
    with xarray.open_dataset(folder / "small" / "points.nc", engine="h5netcdf") as found:
        return found.load()


def runs(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "small" / "runs").glob("*.h5")}


def test_the_table_has_an_axis_for_each_path_and_says_what_its_runs_say(done):
    found = table(done)
    assert found.energy_lost.dims[0] == "world" and found.energy_lost.shape == (2, 1, 1, 2, 2)
    assert len(runs(done)) == 8 and not found.error.any()
    assert found.energy_lost.attrs["units"] == "J"
    struck = found.sel({"world": "IAPB", "bodies.striker.velocity.1": 0.1})
    elastic, plastic = (struck.sel({"contact.restitution": e}) for e in (1.0, 0.0))
    assert abs(elastic.energy_lost.item()) < 1e-6 and elastic.impacts == 1
    run = read_run(done / "small" / "runs" / plastic.file.item())
    assert run.world == "IAPB" and plastic.energy_lost == run.impacts.energy_lost.sum() > 1e-6
    assert run.energy["kinetic"][-1] == plastic.kinetic_energy < run.energy["kinetic"][0]


def test_a_point_that_has_a_file_is_not_simulated_again_and_a_missing_one_is(done, capsys):
    before = runs(done)
    finished = table(done)
    lost = done / "small" / "runs" / min(before)
    lost.unlink()
    assert (
        sweep(done) == 0
        and "8 points, 1 of them simulated now, 0 failed" in capsys.readouterr().out
    )
    after = runs(done)
    assert {name for name in before if after[name] != before[name]} == {lost.name}
    assert table(done).equals(finished)
    assert sweep(done) == 0 and runs(done) == after


def test_a_damaged_or_impossible_point_costs_its_own_row(done, tmp_path, capsys):
    damaged = done / "small" / "runs" / max(runs(done))
    content = damaged.read_bytes()
    finished = table(done)
    damaged.write_bytes(content[:-100])
    assert sweep(done, "--json") == 1
    told = json.loads(capsys.readouterr().out)
    assert told["failed"] == 1 == sum(damaged.name in row["error"] for row in told["points"])
    assert int((table(done).error != "").sum()) == 1
    damaged.write_bytes(content)
    assert sweep(done) == 0 and table(done).equals(finished)
    wrong = STUDY.replace("[0, 1]", "[0, 2]").replace("[IAPB, PB]", "[IAPB]")
    (tmp_path / "small.yaml").write_text(wrong)
    assert sweep(tmp_path) == 1
    right, row = (table(tmp_path).sel({"contact.restitution": e}) for e in (0.0, 2.0))
    assert not right.impacts.isnull().any() and row.impacts.isnull().all()
    assert "contact.restitution" in row.error.item(0)


@pytest.mark.parametrize(
    "kill", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.thorough)]
)
def test_a_killed_sweep_keeps_its_finished_points_and_continues(done, tmp_path, kill):
    (tmp_path / "small.yaml").write_text(STUDY)
    command = [sys.executable, "-m", "iapb", "sweep", "small.yaml", "--workers", "1", "--out", "."]
    heed = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # a job in the background does not
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    child = subprocess.Popen(command, cwd=tmp_path, env=environment, preexec_fn=heed)
    while not runs(tmp_path) and child.poll() is None:
        time.sleep(0.01)
    child.send_signal(kill)
    assert child.wait(60) == (130 if kill == signal.SIGINT else -kill)
    kept = runs(tmp_path)
    assert 1 <= len(kept) < 8 and not (tmp_path / "small" / "points.nc").exists()
    assert sweep(tmp_path) == 0
    assert kept.items() <= runs(tmp_path).items() and table(tmp_path).equals(table(done))


@pytest.mark.thorough
def test_two_processes_and_a_cluster_give_the_same_table(done, tmp_path):
    (tmp_path / "small.yaml").write_text(STUDY)
    assert sweep(tmp_path, "--workers", "2") == 0 and table(tmp_path).equals(table(done))
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    (tmp_path / "cluster").mkdir()
    (tmp_path / "cluster" / "small.yaml").write_text(STUDY)
    with distributed.LocalCluster(**ONE_THREAD | {"n_workers": 2}) as local:
        assert sweep(tmp_path / "cluster", "--dask", local.scheduler_address) == 0
    assert table(tmp_path / "cluster").equals(table(done))


def test_a_scheduler_that_is_not_there_or_dies_is_told_in_one_sentence():
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with pytest.raises(ArgumentError, match="--dask"), executor(1, "nonsense://nowhere"):
        pass
    said = "the scheduler at tcp://127.0.0.1:.* no longer answers; finished"
    with (
        distributed.LocalCluster(**ONE_THREAD) as local,
        pytest.raises(IapbError, match=said),
        executor(1, local.scheduler_address) as pool,
    ):
        for _ in pool.map(time.sleep, [0.2] * 50):
            local.close()


def test_the_energy_lost_is_that_of_all_impacts(tmp_path):
    scene = load_scene(find_scene("newton_cradle")).with_values({"contact.restitution": 0.5})
    row = simulate_point(scene, tmp_path, code_version(), {"world": "IAPB"})
    lost = read_run(tmp_path / row["file"]).impacts.energy_lost
    assert len(lost) > 1 and row["energy_lost"] == lost.sum() > lost[0] > 0.0


def test_a_worker_of_another_version_or_without_the_folder_says_so(tmp_path):
    scene = load_scene(find_scene("two_discs"))
    point = {"world": "IAPB"}
    for folder, code in ((tmp_path, "other code"), (tmp_path / "absent", code_version())):
        assert "another version of iapb" in simulate_point(scene, folder, code, point)["error"]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("worlds:", "worldsx:", "worldsx"),
        ("[IAPB, PB]", "[IAPB, BP]", "BP"),
        ("[0, 1]", "[[0, 1]]", "contact.restitution"),
        ("[0, 1]", f"[{'0, ' * 30_000} 1]", "at most"),
        ("two_discs", "../two_discs.yaml", "scene"),
        ("contact.restitution", "contact/restitution", "contact/restitution"),
    ],
)
def test_a_mistake_is_told_with_its_place(old, new, said, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY.replace(old, new))
    with pytest.raises((SceneError, ArgumentError), match=said):
        load_study(path)


def test_each_study_that_comes_with_the_project_can_be_run():
    assert len(scene_names("sweeps")) == 2
    for name in scene_names("sweeps"):
        study, scene = load_study(find_scene(name, "sweeps"))
        point = next(study.points())
        assert point.pop("world") in study.worlds and scene.with_values(point).name == scene.name
