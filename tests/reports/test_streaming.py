"""A run that is streamed, stopped, killed or cut off comes to the bits of one that is held in memory."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import reports.streaming as streaming
from iapb.errors import RunFileError
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import INTERRUPTED
from reference.worlds import run_world
from reports.runner import Runner
from reports.store.care import LEFTOVER, PARTIAL, check_store, garbage
from reports.store.keys import content_hash
from reports.store.logs import CHUNK, STATE, LogLocked, RunLog, read_log
from reports.store.runs import opened_run, read_run
from reports.streaming import logs_of_killed, recover

# planar with impacts and a device; a tool that is carried; space, contacts and no device; a law in Python
CASES = [("peg_corner", "IAPB", 3000), ("peg_corner", "CBuc", 2500), ("arm_obstacles", "PB", 1200),
         ("peg_corner", "ideal", 1100)]  # fmt: skip


def scene_of(name: str, steps: int) -> Scene:
    scene = load_scene(find_scene(name))
    return scene.with_values({"duration": steps / scene.rate})


@pytest.fixture(autouse=True)
def a_state_in_every_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streaming, "PAUSE", 0.0)
    monkeypatch.setattr(streaming, "_STATE_SHARE", 1e9)
    monkeypatch.setattr(streaming, "HELD", 1)


def whole(name: str, world: str, steps: int) -> str:
    return content_hash(run_world(scene_of(name, steps), world))


@pytest.mark.parametrize(("name", "world", "steps"), CASES)
def test_a_streamed_run_has_the_content_of_one_held_in_memory(
    tmp_path: Path, name: str, world: str, steps: int
) -> None:
    place, streamed = Runner(tmp_path).stream(scene_of(name, steps), world)
    assert streamed.entry.content_hash == whole(name, world, steps) == content_hash(read_run(place.path))
    with opened_run(place.path) as (run, _):
        assert run.steps == steps and run.chunk_steps[:].sum() == steps
    assert {path.suffix for path in tmp_path.iterdir()} == {".h5", ".json"}  # no log is left


class Interrupting:
    """Ctrl-C after some chunks."""

    def __init__(self, chunks: int) -> None:
        self.left = chunks

    def __call__(self, done: int, total: int) -> None:
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize(("name", "world", "steps"), CASES)
def test_a_stopped_run_goes_on_to_the_same_bits(tmp_path: Path, name: str, world: str, steps: int) -> None:
    runner = Runner(tmp_path, Interrupting(2))
    place, stopped = runner.stream(scene_of(name, steps), world)
    assert (stopped.stopped, stopped.entry) == (INTERRUPTED, None)
    assert read_run(place.partial).steps == 2 * 512
    runner.progress = None
    place, streamed = runner.stream(scene_of(name, steps), world, resume=True)
    assert streamed.resumed_at == 512 and streamed.entry.content_hash == whole(name, world, steps)
    assert not list(tmp_path.glob("*.partial")) and not list(tmp_path.glob("*.log"))


def killed(tmp_path: Path) -> tuple[Path, Scene]:
    """The log that a process leaves which is killed in its fifth chunk."""
    scene = scene_of("peg_corner", 4000)
    process = os.fork()
    if process == 0:
        Runner(tmp_path, lambda done, total: os._exit(9) if done > 2048 else None).stream(scene, "IAPB")
    os.waitpid(process, 0)
    [log] = tmp_path.glob("*.log")
    return log, scene


def test_what_a_kill_cut_off_anywhere_is_computed_again(tmp_path: Path) -> None:
    log, scene = killed(tmp_path)
    content, right = log.read_bytes(), whole("peg_corner", "IAPB", 4000)
    states = [block.end for block in read_log(log)[1] if block.line["kind"] == STATE]
    rng = np.random.default_rng(0)
    cuts = [0, 10, states[0] - 1, states[0], len(content) - 1, *rng.integers(0, len(content), 4)]
    for cut in map(int, cuts):
        log.write_bytes(content[:cut])
        if cut < 50:
            with pytest.raises(RunFileError, match="no log"):
                Runner(tmp_path).stream(scene, "IAPB", resume=True)
            continue
        place, streamed = Runner(tmp_path).stream(scene, "IAPB", resume=True)
        assert streamed.resumed_at == 512 * sum(end <= cut for end in states)
        assert streamed.entry.content_hash == right
        place.path.unlink()


def test_a_damaged_log_goes_on_from_before_the_damage(tmp_path: Path) -> None:
    log, scene = killed(tmp_path)
    content, blocks = log.read_bytes(), list(read_log(log)[1])
    states = [number for number, block in enumerate(blocks) if block.line["kind"] == STATE]
    for number in (states[-1], states[-1] - 1, states[0] + 1):
        block = blocks[number]
        for place in (block.start + 30, block.end - 5):  # in its line, in its numbers
            log.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1:])
            place, streamed = Runner(tmp_path).stream(scene, "IAPB", resume=True)
            assert streamed.resumed_at == 512 * sum(each < number for each in states)
            assert streamed.entry.content_hash == whole("peg_corner", "IAPB", 4000)
            place.path.unlink()


def test_a_block_that_is_lost_doubled_or_exchanged_ends_the_log(tmp_path: Path) -> None:
    log, _ = killed(tmp_path)
    content, blocks = log.read_bytes(), list(read_log(log)[1])
    head, pieces = content[: blocks[0].start], [content[each.start : each.end] for each in blocks]
    chunks = [number for number, each in enumerate(blocks) if each.line["kind"] == CHUNK]
    first, second = chunks[1:3]
    swapped = [*pieces]
    swapped[first], swapped[second] = pieces[second], pieces[first]
    for wrong in (pieces[:first] + pieces[first + 1 :], [*pieces[:first], pieces[first - 1], *pieces[first:]], swapped):
        log.write_bytes(head + b"".join(wrong))
        assert len(list(read_log(log)[1])) == first


def test_a_log_of_another_run_or_of_nobody_is_refused(tmp_path: Path) -> None:
    log, _ = killed(tmp_path)
    other = scene_of("peg_corner", 4100)
    place, _ = Runner(tmp_path, Interrupting(1)).stream(other, "IAPB")
    streaming.log_of(place.path).write_bytes(log.read_bytes())
    with pytest.raises(RunFileError, match="another run"):
        Runner(tmp_path).stream(other, "IAPB", resume=True)
    foreign = tmp_path / "foreign.h5.log"
    foreign.write_bytes(Path(__file__).read_bytes())
    with pytest.raises(RunFileError, match="no log"):
        read_log(foreign)
    with pytest.raises(RunFileError, match="not a log"):
        RunLog(foreign, {})
    assert foreign.read_bytes() == Path(__file__).read_bytes()


def test_two_processes_do_not_write_one_log(tmp_path: Path) -> None:
    held = RunLog(tmp_path / "x.h5.log", {})
    with pytest.raises(LogLocked):
        RunLog(tmp_path / "x.h5.log", {})
    held.close()
    RunLog(tmp_path / "x.h5.log", {}).close(remove=True)
    assert not list(tmp_path.iterdir())


def test_repair_makes_what_a_killed_run_did_readable(tmp_path: Path) -> None:
    log, scene = killed(tmp_path)
    run = scene_of("peg_corner", 2048)
    assert [state.state for state in check_store(tmp_path)] == [LEFTOVER] and not garbage(tmp_path)
    [partial] = map(recover, logs_of_killed(tmp_path))
    assert np.array_equal(read_run(partial).q, run_world(run, "IAPB").q)
    assert PARTIAL in [state.state for state in check_store(tmp_path)]
    _, streamed = Runner(tmp_path).stream(scene, "IAPB", resume=True)
    assert streamed.resumed_at == 2048 and streamed.entry.content_hash == whole("peg_corner", "IAPB", 4000)
