"""Care of the store: damage is found and set aside, garbage goes, runs come out the same again."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from iapb.errors import ArgumentError, RunFileError
from reports.evidence.runs import shipped_scene
from reports.resimulate import repeat_run
from reports.runner import Runner
from reports.store import write_run
from reports.store.care import (
    DAMAGED,
    DAMAGED_SUFFIX,
    FOREIGN,
    LEFTOVER,
    PARTIAL,
    STALE,
    WHOLE,
    check_store,
    collect_garbage,
    garbage,
    repair_store,
)
from reports.store.runs import read_run

SHORT = {"duration": 0.05}


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    """A store of two runs."""
    runner = Runner(tmp_path / "runs")
    for world in ("IAPB", "PB"):
        runner(shipped_scene("peg_corner", SHORT), world)
    return tmp_path


def runs(folder: Path) -> list[Path]:
    return sorted((folder / "runs").glob("*.h5"))


def states(folder: Path) -> dict[str, str]:
    return {state.path.name: state.state for state in check_store(folder)}


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))


def test_a_sound_store_is_whole(filled: Path) -> None:
    assert set(states(filled).values()) == {WHOLE}


def test_every_kind_of_file_is_told(filled: Path) -> None:
    import h5py

    damage(runs(filled)[0])
    whole = runs(filled)[1]
    run = read_run(whole)
    write_run(whole.with_name("unfinished.h5.partial"), run)
    (filled / "runs" / ".x.h5.1.writing").write_bytes(b"half")
    (filled / "runs" / "text.h5").write_text("no HDF5")
    with h5py.File(filled / "runs" / "other.h5", "w") as file:
        file["x"] = 1
    found = states(filled)
    assert found[runs(filled)[0].name] == DAMAGED or DAMAGED in found.values()
    assert found["unfinished.h5.partial"] == PARTIAL
    assert found[".x.h5.1.writing"] == LEFTOVER
    assert found["text.h5"] == DAMAGED
    assert found["other.h5"] in (FOREIGN, DAMAGED)
    assert found[whole.name] == WHOLE


def test_a_damaged_run_is_set_aside_and_computed_again(filled: Path) -> None:
    scene, path = shipped_scene("peg_corner", SHORT), runs(filled)[0]
    world = read_run(path).world
    before = path.read_bytes()
    damage(path)
    with pytest.raises(RunFileError):
        Runner(filled / "runs")(scene, world)
    repair_store(filled)
    assert path.with_name(path.name + DAMAGED_SUFFIX).is_file()
    assert not path.exists()
    Runner(filled / "runs")(scene, world)
    assert path.is_file() and len(path.read_bytes()) > 0.5 * len(before)
    assert [entry.file for entry in Runner(filled / "runs").store.entries()] == [p.name for p in runs(filled)]


def test_garbage_is_what_no_present_code_asks_for(filled: Path) -> None:
    assert garbage(filled) == ()
    run = read_run(runs(filled)[0])
    write_run(filled / "runs" / "old-0000000000000000.h5", run, key="0" * 64)
    (filled / "runs" / ".y.h5.1.writing").write_bytes(b"half")
    write_run(runs(filled)[0].with_name(runs(filled)[0].name + ".partial"), run)
    (filled / "tables").mkdir()
    (filled / "tables" / "claims-0123456789abcdef.h5").write_bytes(b"old")
    kept = {path.name for path in runs(filled)} - {"old-0000000000000000.h5"}
    assert sorted(state.state for state in garbage(filled)) == sorted([STALE, LEFTOVER, PARTIAL, STALE])
    collect_garbage(filled)
    assert {path.name for path in filled.rglob("*.h5*")} == kept
    assert garbage(filled) == ()


@pytest.mark.parametrize("world", ["IAPB", "PB", "ideal", "CBuc", "IAPB-friction"])
def test_a_run_comes_out_the_same_from_its_own_file(tmp_path: Path, world: str) -> None:
    runner, scene = Runner(tmp_path), shipped_scene("peg_corner", {"duration": 0.2, "contact.friction": 0.2})
    runner(scene, world)
    repetition = repeat_run(next(tmp_path.glob("*.h5")))
    assert repetition.same and repetition.differs == ()


def test_a_run_that_does_not_come_out_the_same_is_told_with_what_differs(tmp_path: Path) -> None:
    from dataclasses import replace

    run = Runner(tmp_path)(shipped_scene("peg_corner", SHORT), "IAPB")
    forged = replace(run, q=run.q + 1e-15)
    write_run(tmp_path / "forged.h5", forged)
    repetition = repeat_run(tmp_path / "forged.h5")
    assert not repetition.same
    assert repetition.differs == ("trajectory/q",)


def test_a_run_of_an_unknown_law_cannot_be_made_again(tmp_path: Path) -> None:
    from dataclasses import replace

    run = Runner(tmp_path)(shipped_scene("peg_corner", SHORT), "IAPB")
    write_run(tmp_path / "mine.h5", replace(run, law="mine"))
    with pytest.raises(ArgumentError, match="mine"):
        repeat_run(tmp_path / "mine.h5")


def test_a_law_of_ones_own_is_made_again_where_a_world_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from iapb.contact.laws import Penalty
    from reference import worlds

    class Mine(Penalty):
        name = "springs of mine"

    monkeypatch.setitem(worlds.WORLDS, "mine", lambda rendering: worlds.World("mine", Mine(), "four-channel"))
    Runner(tmp_path)(shipped_scene("peg_corner", SHORT), "mine")
    path = next(tmp_path.glob("*.h5"))
    assert repeat_run(path).same
    monkeypatch.setattr(Mine, "settings", {"stiffness": "another"})
    with pytest.raises(ArgumentError, match="springs of mine"):
        repeat_run(path)


def test_the_command_speaks_and_its_status_tells(filled: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from reports.cli import main

    assert main(["store", "check", str(filled)]) == 0
    assert main(["store", "again", str(runs(filled)[0])]) == 0
    assert "the same to the last bit" in capsys.readouterr().out
    damage(runs(filled)[0])
    assert main(["store", "check", str(filled)]) == 1
    assert main(["store", "repair", str(filled)]) == 0
    assert main(["store", "gc", str(filled), "--dry-run"]) == 0
    assert any(name.endswith(DAMAGED_SUFFIX) for name in os.listdir(filled / "runs"))
    assert main(["store", "gc", str(filled)]) == 0
    assert not any(name.endswith(DAMAGED_SUFFIX) for name in os.listdir(filled / "runs"))
    assert main(["store", "check", str(filled / "nowhere")]) == 1
