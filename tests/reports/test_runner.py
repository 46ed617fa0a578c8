"""Runs through the store: computed once, kept, never overwritten, never half a run taken for a
whole one, made again.

A run that is stopped is computed again, and the command beside a run makes that run again, to the
last bit.
"""

import shlex

import numpy as np
import pytest

from iapb.errors import RunFileError
from iapb.scene import find_scene, load_scene, scene_names
from iapb.simulation import INTERRUPTED, simulate
from reports import cli
from reports.evidence import energy
from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.runner import Runner
from reports.store import RunStore, content_hash, read_run, write_run
from reports.store.uses import run_command
from tests.reports.made_up import made_run
from verification.check import Study

WHOLE = load_scene(find_scene("peg_corner"))
PEG = WHOLE.with_values({"duration": 1.2})
INPUTS = {"scene": {"name": "peg", "rate": 512}, "law": "IAPB"}


def test_a_finished_run_is_neither_computed_again_nor_overwritten_and_a_partial_one_is(tmp_path):
    store = RunStore(tmp_path)
    run = made_run()
    partial = made_run(complete=False)
    place = store.place_of(INPUTS, "peg corner/IAPB")
    assert not store.fetch(place, lambda: partial)[0].complete
    assert (
        not read_run(place.partial).complete and not place.path.exists() and store.entries() == ()
    )
    assert store.fetch(place, lambda: run)[0] is run and not place.partial.exists()
    again = RunStore(tmp_path)
    kept, _ = again.fetch(again.place_of(INPUTS, "any"), pytest.fail)
    assert content_hash(kept) == content_hash(run)
    before = place.path.read_bytes()
    assert write_run(place.path, made_run(0.5)).read_bytes() == before
    (tmp_path / "other.h5").write_text("no run")
    [entry] = store.entries()
    assert (entry.file, entry.content_hash) == (place.path.name, content_hash(run))
    place.path.write_bytes(before[:5000])
    with pytest.raises(RunFileError, match=place.path.name):  # damage is reported, and left there
        store.fetch(place, pytest.fail)
    assert place.path.stat().st_size == 5000


@pytest.fixture
def computed(monkeypatch):
    """Names of the worlds that were simulated."""
    names = []

    def counting(*arguments, **options):
        names.append(options["world"])
        return simulate(*arguments, **options)

    monkeypatch.setattr("reports.runner.simulate", counting)
    return names


def test_a_run_is_computed_once_by_all_runners_of_a_folder(tmp_path, computed):
    seen = []
    first = Runner(tmp_path, lambda done, total: seen.append((done, total)))(PEG, "IAPB")
    assert seen == sorted(seen) and seen[-1] == (PEG.steps, PEG.steps)
    runner = Runner(tmp_path)
    second = runner(PEG, "IAPB")
    assert np.array_equal(first.q, second.q) and runner(PEG, "IAPB") is second
    [used] = runner.used.values()
    assert np.array_equal(read_run(tmp_path / used.file).q, first.q)
    run = runner(PEG, "PB", keep=False)
    assert runner(PEG, "PB", keep=False) is not run and computed == ["IAPB", "PB"]


def test_ctrl_c_in_a_run_stops_who_asked_for_it_and_keeps_what_was_done(tmp_path, computed):
    def interrupt(done, total):
        raise KeyboardInterrupt

    runner = Runner(tmp_path, interrupt)
    with pytest.raises(KeyboardInterrupt):
        runner(PEG, "IAPB")
    [partial] = tmp_path.glob("*.partial")
    kept = read_run(partial)
    assert (
        not kept.complete
        and kept.stopped == INTERRUPTED
        and 0 < kept.steps < PEG.steps
        and not runner.used
    )
    runner(PEG, "IAPB", partial=True)
    assert [used.file.endswith(".partial") for used in runner.used.values()] == [True]
    runner.progress = None
    assert (
        runner(PEG, "IAPB").complete
        and computed == ["IAPB"] * 3
        and not list(tmp_path.glob("*.partial"))
    )


def test_every_engine_run_used_before_is_certified(tmp_path):
    runner = Runner(tmp_path)
    run = runner(PEG, "IAPB")
    runner(PEG, "PB")
    discs = load_scene(find_scene("two_discs")).with_values({"duration": 0.1})
    assert len(
        runner(discs, "ideal").impacts.step
    )  # left out: a rigid step solves impulses and forces together
    with runner.recording("a topic") as inside:
        table = energy.RUNS.table(Study(runner))
    assert table["impacts"] == [len(run.impacts.step)] and len(run.impacts.step) > 0
    assert not inside and len(runner.files) == 3


# The command beside a run

CHANGED = {
    "duration": 0.4,
    "bodies.peg.position": [0.0205, -0.013250000000000001, 1e-7],
    "contact.friction": 0.1,
    "walls.floor.normal": [0.1, -1.0],
    "device.delay": 1,
    "gravity": [0.0, 9.81],
    "couplings.unilateral": None,
    "title": 'it\'s "quoted": {a, b} # and more',
}


@pytest.mark.parametrize(
    ("values", "world", "rendering", "status"),
    [({"duration": 0.4}, "PB", "full", 0), (CHANGED, "IAPB", "spread", 3)],
)  # 3: the floor is tilted into the peg
def test_a_pasted_command_makes_the_same_run_again(values, world, rendering, status, tmp_path):
    runner = Runner(tmp_path / "one")
    runner(WHOLE.with_values(values), world, rendering)
    [used] = runner.used.values()
    program, *words = shlex.split(used.command)
    assert program == "iapb" and cli.main([*words, "--out", str(tmp_path / "two")]) == status
    [again] = Runner(tmp_path / "two").store.entries()
    assert (again.file, again.content_hash) == (used.file, used.content_hash)


def test_every_scene_and_every_run_of_the_figures_has_a_command_and_a_scene_of_ones_own_its_file(
    tmp_path,
):
    assert all(run_command(load_scene(find_scene(name)), "IAPB") for name in scene_names())
    for scene, values, world, rendering in FIGURE_RUNS.values():
        command = run_command(shipped_scene(scene, values), world, rendering)
        assert command.startswith(f"iapb run {scene} ") and command.count("--set") == len(values)
    runner = Runner(tmp_path)
    runner(WHOLE.with_values({"name": "own", "duration": 0.4}), "PB")
    [used] = runner.used.values()
    assert used.command == f"iapb store again out/runs/{used.file}"
    assert cli.main(["store", "again", str(tmp_path / used.file)]) == 0


# Thinned runs


def test_a_thinned_run_has_its_own_file_and_comes_out_the_same_again(tmp_path):
    run, entry = Runner(tmp_path).fetch(PEG, "IAPB", every=10)
    whole = Runner(tmp_path)(PEG, "IAPB")
    assert (
        run.every == 10
        and run.steps < whole.steps == run.steps_done
        and len(list(tmp_path.glob("*.h5"))) == 2
    )
    assert read_run(tmp_path / entry.file).every == 10
    assert cli.main(["store", "again", str(tmp_path)]) == 0 == cli.main(["certify", str(tmp_path)])
    assert cli.main(["inspect", str(tmp_path / entry.file)]) == 0
