"""A run that is streamed, stopped, killed or cut off comes to the bits of one that is held in memory."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import reports.streaming as streaming
from iapb.errors import RunFileError
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import INTERRUPTED
from reference.worlds import run_world
from reports.resimulate import recover
from reports.runner import Runner
from reports.store.care import LEFTOVER, PARTIAL, check_store, garbage, parts_of_killed
from reports.store.keys import content_hash
from reports.store.parts import Parts, PartsLocked, parts_of, read_parts
from reports.store.runs import opened_run, read_entry, read_run

# planar with impacts and a device; a tool that is carried; space, contacts and no device; a law in Python
CASES = [("peg_corner", "IAPB", 3000), ("peg_corner", "CBuc", 2500), ("arm_obstacles", "PB", 1200),
         ("peg_corner", "ideal", 1100)]  # fmt: skip


def scene_of(name: str, steps: int) -> Scene:
    scene = load_scene(find_scene(name))
    return scene.with_values({"duration": steps / scene.rate})


@pytest.fixture(autouse=True)
def a_part_for_every_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streaming, "PAUSE", 0.0)
    monkeypatch.setattr(streaming, "_PARTS_SHARE", 1e9)
    monkeypatch.setattr(streaming, "HELD", 1)


def stop_after(chunks: int) -> object:
    """Ctrl-C after some chunks."""
    def progress(done: int, total: int) -> None:
        if done >= 512 * chunks:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize(("name", "world", "steps"), CASES)
def test_a_streamed_run_stopped_or_not_has_the_content_of_one_held_in_memory(
    tmp_path: Path, name: str, world: str, steps: int
) -> None:
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


@pytest.fixture
def killed(tmp_path: Path) -> tuple[Path, Scene]:
    """The parts that a process leaves which is killed in its fifth chunk, and its scene."""
    scene = scene_of("peg_corner", 2600)
    process = os.fork()
    if process == 0:
        Runner(tmp_path, lambda done, total: os._exit(9) if done > 2048 else None).stream(scene, "IAPB")
    os.waitpid(process, 0)
    [parts] = tmp_path.glob("*.parts")
    return parts, scene


def flip(path: Path, share: float) -> None:
    content = bytearray(path.read_bytes())
    content[int(share * len(content))] ^= 1
    path.write_bytes(content)


def test_what_is_cut_off_damaged_lost_doubled_or_exchanged_is_computed_again(killed: tuple[Path, Scene]) -> None:
    parts, scene = killed
    whole, right = parts.with_name("whole"), content_hash(run_world(scene, "IAPB"))
    shutil.copytree(parts, whole)
    names = sorted(path.name for path in parts.glob("*.part"))
    assert len(names) == 5  # the head, and four chunks
    harms = {
        "cut": lambda one, other: os.truncate(one, one.stat().st_size // 2),
        "cut to nothing": lambda one, other: os.truncate(one, 0),
        "damaged in its line": lambda one, other: flip(one, 0.01),
        "damaged in its numbers": lambda one, other: flip(one, 0.7),
        "lost": lambda one, other: one.unlink(),
        "doubled": lambda one, other: shutil.copy(other, one),
        "exchanged": lambda one, other: (shutil.copy(one, one.with_name("x")), shutil.copy(other, one),
                                         os.replace(one.with_name("x"), other)),
    }  # fmt: skip
    for k, (harm, harmed) in enumerate((harm, at) for harm in harms for at in (2, 4)):
        shutil.rmtree(parts, ignore_errors=True)
        shutil.copytree(whole, parts)
        harms[harm](parts / names[harmed], parts / names[3])
        assert len(list(read_parts(parts))) == (2 if harm == "exchanged" and harmed == 4 else harmed - 1), (k, harm)
        place, streamed = Runner(parts.parent).stream(scene, "IAPB", resume=True)
        assert streamed.resumed_at == 512 * (2 if harm == "exchanged" and harmed == 4 else harmed - 1)
        assert read_entry(place.path).content_hash == right
        place.path.unlink()
    shutil.copytree(whole, parts)
    flip(parts / names[0], 0.5)
    with pytest.raises(RunFileError, match="first part"):
        Runner(parts.parent).stream(scene, "IAPB", resume=True)
    _, streamed = Runner(parts.parent).stream(scene, "IAPB")
    assert not streamed.resumed_at and not parts.exists()


def test_parts_of_another_run_or_of_nobody_are_refused_and_left(killed: tuple[Path, Scene], tmp_path: Path) -> None:
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
    with pytest.raises(RunFileError):
        Runner(tmp_path).stream(other, "IAPB", resume=True)
    with pytest.raises(RunFileError, match="only 0 of"):
        Runner(tmp_path).stream(other, "IAPB")
    assert theirs.read_text() == "somebody else's" and not place.path.exists()


def test_two_processes_do_not_write_one_run(tmp_path: Path) -> None:
    held = Parts(tmp_path / "x.h5.parts", {})
    with pytest.raises(PartsLocked):
        Parts(tmp_path / "x.h5.parts", {})
    held.close()
    Parts(tmp_path / "x.h5.parts", {}).close(remove=True)
    assert not list(tmp_path.iterdir())


def test_repair_makes_what_a_killed_run_did_readable(killed: tuple[Path, Scene], tmp_path: Path) -> None:
    _, scene = killed
    assert [state.state for state in check_store(tmp_path)] == [LEFTOVER] and not garbage(tmp_path)
    [partial] = map(recover, parts_of_killed(tmp_path))
    assert np.array_equal(read_run(partial).q, run_world(scene_of("peg_corner", 2048), "IAPB").q)
    assert PARTIAL in [state.state for state in check_store(tmp_path)]
    place, streamed = Runner(tmp_path).stream(scene, "IAPB", resume=True)
    assert streamed.resumed_at == 2048
    assert read_entry(place.path).content_hash == content_hash(run_world(scene, "IAPB"))
