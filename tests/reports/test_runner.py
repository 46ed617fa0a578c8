"""Runs through the store: computed once, kept, never overwritten, never half a run taken for a whole one, made again.

A run that is streamed, stopped, killed or cut off comes to the bits of one that is held in memory, and the command
beside a run makes that run again, to the last bit.
"""

import os
import shlex
import shutil
from dataclasses import replace

import numpy as np
import pytest

from iapb.errors import ArgumentError, RunFileError
from iapb.recording import Recorder
from iapb.scene import find_scene, load_scene, scene_names
from iapb.simulation import INTERRUPTED, Simulation, simulate
from reference.worlds import run_world
from reports import cli, streaming
from reports.evidence import exact_energy
from reports.evidence.runs import FIGURE_RUNS, shipped_scene
from reports.runner import Runner
from reports.store import RunStore, content_hash, read_run
from reports.store.parts import Parts, PartsLocked, parts_of, read_parts
from reports.store.runs import opened_run, read_entry, store_run
from reports.uses import parsed, run_command
from tests.reports.made_up import flipped, made_run
from verification.check import Study

WHOLE = load_scene(find_scene("peg_corner"))
PEG = WHOLE.with_values({"duration": 1.2})
INPUTS = {"scene": {"name": "peg", "rate": 512}, "law": "IAPB"}


def test_a_finished_run_is_neither_computed_again_nor_overwritten_and_a_partial_one_is(tmp_path):
    store, run = RunStore(tmp_path), made_run()
    partial, label = made_run(steps=10, complete=False), "peg corner/IAPB"
    place = store.place_of(INPUTS, label)
    assert not store.get_or_run(INPUTS, lambda: partial, label).complete
    assert read_run(place.partial).steps == 10 and not place.path.exists() and store.entries() == ()
    with pytest.raises(ArgumentError, match="complete"):
        store.put(INPUTS, partial)
    assert store.get_or_run(INPUTS, lambda: run, label) is run and not place.partial.exists()
    assert content_hash(RunStore(tmp_path).get_or_run(INPUTS, pytest.fail, label="any")) == content_hash(run)
    [path] = tmp_path.glob("*.h5")
    before = path.read_bytes()
    assert store.put(INPUTS, made_run(seed=2)) == path and path.read_bytes() == before
    (tmp_path / "other.h5").write_text("no run")
    [entry] = store.entries()
    assert (entry.file, entry.title, entry.content_hash) == (path.name, "peg · IAPB", content_hash(run))
    path.write_bytes(before[:5000])
    with pytest.raises(RunFileError, match=path.name):  # damage is reported, and left where it is
        store.get_or_run(INPUTS, pytest.fail)
    assert path.stat().st_size == 5000


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
    assert (used.status, used.size) == ("complete", (tmp_path / used.file).stat().st_size)
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
    assert not kept.complete and kept.stopped == INTERRUPTED and 0 < kept.steps < PEG.steps and not runner.used
    runner(PEG, "IAPB", partial=True)
    assert [used.status for used in runner.used.values()] == ["partial"]
    runner.progress = None
    assert runner(PEG, "IAPB").complete and computed == ["IAPB"] * 3 and not list(tmp_path.glob("*.partial"))


def test_every_engine_run_used_before_is_certified(tmp_path):
    runner = Runner(tmp_path)
    run = runner(PEG, "IAPB")
    runner(PEG, "PB")
    discs = load_scene(find_scene("two_discs")).with_values({"duration": 0.1})
    assert len(runner(discs, "ideal").impacts.step)  # left out: a rigid step solves impulses and forces together
    with runner.recording("a topic") as inside:
        table = exact_energy.TOPIC.checks[0].table(Study(runner))
    assert table.column("impacts") == [len(run.impacts.step)] and len(run.impacts.step) > 0
    assert not inside and len(runner.files) == 3


# The command beside a run

CHANGED = {
    "duration": 0.4, "bodies.peg.position": [0.0205, -0.013250000000000001, 1e-7], "contact.friction": 0.1,
    "walls.floor.normal": [0.1, -1.0], "device.delay": 1, "gravity": [0.0, 9.81], "couplings.unilateral": None,
    "title": "it's \"quoted\": {a, b} # and more",
}  # fmt: skip


@pytest.mark.parametrize(("values", "world", "rendering", "status"), [
    ({"duration": 0.4}, "PB", "full", 0), (CHANGED, "IAPB", "spread", 3)])  # 3: the floor is tilted into the peg
def test_a_pasted_command_makes_the_same_run_again(values, world, rendering, status, tmp_path):
    runner = Runner(tmp_path / "one")
    runner(WHOLE.with_values(values), world, rendering)
    [used] = runner.used.values()
    program, *words = shlex.split(used.command)
    assert program == "iapb" and cli.main([*words, "--out", str(tmp_path / "two")]) == status
    [again] = Runner(tmp_path / "two").store.entries()
    assert (again.file, again.run_key, again.content_hash) == (used.file, used.key, used.content_hash)


def test_every_scene_and_every_run_of_the_figures_has_a_command_and_a_scene_of_ones_own_its_file(tmp_path):
    named, numbered = (WHOLE.with_values(parsed([f"{path}=3"])) for path in ("bodies.peg.mass", "bodies[0].mass"))
    assert named.resolved() == numbered.resolved() != WHOLE.resolved()
    assert all(run_command(load_scene(find_scene(name)), "IAPB") for name in scene_names())
    for scene, values, world, rendering in FIGURE_RUNS.values():
        command = run_command(shipped_scene(scene, values), world, rendering)
        assert command.startswith(f"iapb run {scene} ") and command.count("--set") == len(values)
    runner = Runner(tmp_path)
    runner(WHOLE.with_values({"name": "own", "duration": 0.4}), "PB")
    [used] = runner.used.values()
    assert used.command == f"iapb store again out/runs/{used.file}"
    assert cli.main(["store", "again", str(tmp_path / used.file)]) == 0


# Streams

# planar with impacts and a device; a tool that is carried; space, contacts and no device; a law in Python
CASES = [("peg_corner", "IAPB", 1600), ("peg_corner", "CBuc", 1100), ("arm_obstacles", "PB", 1200),
         ("peg_corner", "ideal", 1100)]  # fmt: skip


def scene_of(name, steps):
    scene = load_scene(find_scene(name))
    return scene.with_values({"duration": steps / scene.rate})


@pytest.fixture
def a_part_for_every_chunk(monkeypatch):
    for name, value in (("PAUSE", 0.0), ("_PARTS_SHARE", 1e9), ("HELD", 1)):
        monkeypatch.setattr(streaming, name, value)


def stop_after(chunks):
    """Ctrl-C after some chunks."""
    def progress(done, total):
        if done >= 512 * chunks:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize(("name", "world", "steps"), CASES)
def test_a_streamed_run_stopped_or_not_has_the_content_of_one_held_in_memory(
    name, world, steps, tmp_path, a_part_for_every_chunk
):
    scene = scene_of(name, steps)
    held = content_hash(run_world(scene, world))
    place, streamed = Runner(tmp_path / "whole").stream(scene, world)
    assert not streamed.stopped and held == read_entry(place.path).content_hash == content_hash(read_run(place.path))
    with opened_run(place.path) as (run, _):
        assert run.steps == steps and run.chunk_steps[:].sum() == steps
    runner = Runner(tmp_path, stop_after(2))
    place, stopped = runner.stream(scene, world)
    assert stopped.stopped == INTERRUPTED and stopped.resumable and not place.path.exists()
    assert read_run(place.partial).steps == 2 * 512
    runner.progress = None
    place, streamed = runner.stream(scene, world, resume=True)
    assert streamed.resumed_at == 512 and read_entry(place.path).content_hash == held
    assert {path.suffix for path in tmp_path.rglob("*.*")} == {".h5", ".json"}  # no part is left


def test_what_an_earlier_piece_distrusts_is_kept(tmp_path):
    recorder = Recorder(Simulation(PEG))
    first, last = (recorder.chunk(PEG.steps) or recorder.take("IAPB") for _ in range(2))
    store_run(tmp_path / "a.h5", iter([replace(first, distrust=("it sank",)), last]), key="", provenance={})
    assert read_run(tmp_path / "a.h5").distrust == ("it sank",)


@pytest.fixture
def killed(tmp_path, a_part_for_every_chunk):
    """The parts that a process leaves which is killed in its fifth chunk, and its scene."""
    scene = scene_of("peg_corner", 2600)
    process = os.fork()
    if process == 0:
        Runner(tmp_path, lambda done, total: os._exit(9) if done > 2048 else None).stream(scene, "IAPB")
    os.waitpid(process, 0)
    [parts] = tmp_path.glob("*.parts")
    return parts, scene


def exchange(one, other):
    shutil.copy(one, one.with_name("x"))
    shutil.copy(other, one)
    os.replace(one.with_name("x"), other)


HARMS = {
    "cut": lambda one, other: os.truncate(one, one.stat().st_size // 2),
    "cut to nothing": lambda one, other: os.truncate(one, 0),
    "damaged in its line": lambda one, other: one.write_bytes(flipped(one.read_bytes(), 0.01)),
    "damaged in its numbers": lambda one, other: one.write_bytes(flipped(one.read_bytes(), 0.7)),
    "lost": lambda one, other: one.unlink(), "doubled": lambda one, other: shutil.copy(other, one),
    "exchanged": exchange,
}  # fmt: skip


def test_what_is_cut_off_damaged_lost_doubled_or_exchanged_is_computed_again(killed):
    parts, scene = killed
    whole, right = parts.with_name("whole"), content_hash(run_world(scene, "IAPB"))
    shutil.copytree(parts, whole)
    names = sorted(path.name for path in parts.glob("*.part"))
    assert len(names) == 5  # the head, and four chunks
    for number, (harm, harmed) in enumerate((harm, at) for harm in HARMS for at in (2, 4)):
        shutil.rmtree(parts, ignore_errors=True)
        shutil.copytree(whole, parts)
        HARMS[harm](parts / names[harmed], parts / names[3])
        kept = 2 if harm == "exchanged" and harmed == 4 else harmed - 1
        assert len(list(read_parts(parts))) == kept, (harm, harmed)
        if number % 4 in (1, 2) and harm != "exchanged":  # each harm is resumed at one place, the last one at both
            continue
        place, streamed = Runner(parts.parent).stream(scene, "IAPB", resume=True)
        assert streamed.resumed_at == 512 * kept and read_entry(place.path).content_hash == right
        place.path.unlink()
    shutil.copytree(whole, parts)
    (parts / names[0]).write_bytes(flipped((parts / names[0]).read_bytes()))
    with pytest.raises(RunFileError, match="first part"):
        Runner(parts.parent).stream(scene, "IAPB", resume=True)
    _, streamed = Runner(parts.parent).stream(scene, "IAPB")
    assert not streamed.resumed_at and not parts.exists()


def test_parts_of_another_run_or_of_nobody_are_refused_and_left(killed, tmp_path):
    parts, _ = killed
    other = scene_of("peg_corner", 4100)
    place, _ = Runner(tmp_path, stop_after(1)).stream(other, "IAPB")
    shutil.rmtree(parts_of(place.path), ignore_errors=True)
    shutil.copytree(parts, parts_of(place.path))
    with pytest.raises(RunFileError, match="another run"):
        Runner(tmp_path).stream(other, "IAPB", resume=True)
    shutil.rmtree(parts_of(place.path))
    theirs = parts_of(place.path) / "00000001.part"
    theirs.parent.mkdir()
    theirs.write_text("somebody else's")
    for resume, said in ((True, None), (False, "only 0 of")):
        with pytest.raises(RunFileError, match=said):
            Runner(tmp_path).stream(other, "IAPB", resume=resume)
    assert theirs.read_text() == "somebody else's" and not place.path.exists()
    held = Parts(tmp_path / "own" / "x.h5.parts", {})
    with pytest.raises(PartsLocked):  # two processes do not write one run
        Parts(tmp_path / "own" / "x.h5.parts", {})
    held.close()
    Parts(tmp_path / "own" / "x.h5.parts", {}).close(remove=True)
    assert not list((tmp_path / "own").iterdir())


