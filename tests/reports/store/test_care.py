"""Care of the store: damage is found and set aside, garbage goes, runs come out the same again."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError, RunFileError
from iapb.run import Run
from reports.cli import main
from reports.evidence.runs import shipped_scene
from reports.evidence.stage import Stage
from reports.resimulate import differences, repeat_run
from reports.runner import Runner
from reports.store import (
    Column,
    RunStore,
    Table,
    content_hash,
    read_run,
    write_run,
    write_table,
    write_tables,
)
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
from reports.store.io import MARK_NAME
from reports.store.keys import SOURCES
from reports.store.runs import store_run
from reports.store.schema import GROUPS, RESULT_GROUPS

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


def test_every_kind_of_file_is_told(filled: Path) -> None:
    import h5py

    spoilt, whole = runs(filled)
    damage(spoilt)
    run = read_run(whole)
    write_run(whole.with_name("unfinished.h5.partial"), run)
    (filled / "runs" / ".x.h5.1.writing").write_bytes(b"half")
    (filled / "runs" / "text.h5").write_text("no HDF5")
    with h5py.File(filled / "runs" / "other.h5", "w") as file:
        file["x"] = 1
    found = states(filled)
    assert found[spoilt.name] == DAMAGED
    assert found["unfinished.h5.partial"] == PARTIAL
    assert found[".x.h5.1.writing"] == LEFTOVER
    assert found["text.h5"] == found["other.h5"] == FOREIGN
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


def aged(path: Path) -> Path:
    """Older than any writer takes."""
    os.utime(path, (0, 0))
    return path


OLDER = f"iapb {'0' * 64}"  # what a run of an older engine says of its code


def test_garbage_is_what_no_present_code_asks_for(filled: Path) -> None:
    assert garbage(filled) == ()
    folder, (first, second) = filled / "runs", runs(filled)
    run = read_run(first)
    store_run(folder / "old-0000000000000000.h5", run, key="0" * 64, code=OLDER)
    for name in (".y.h5.1.writing", ".young.h5.1.writing"):
        (folder / name).write_bytes(b"")
    for path in (first, second):
        write_run(path.with_name(path.name + ".partial"), run)
    aged(folder / ".y.h5.1.writing"), aged(first.with_name(first.name + ".partial"))
    made = Stage(filled / "tables", "cost", tuple[float, ...], {"depth": "quick"}, {"a package": "2.1"})
    made.get_or_compute(lambda: (1.0,))
    table = Table("t", (Column("x", (1.0,), "1", "x"),))
    write_tables(filled / "tables" / "claims-0123456789abcdef.h5", (table,), {SOURCES: "older code"})
    found = garbage(filled)
    assert sorted(state.state for state in found) == sorted([STALE, LEFTOVER, PARTIAL, STALE])
    collect_garbage(found)
    young = {".young.h5.1.writing", second.name + ".partial"}
    assert {path.name for path in filled.rglob("*.h5*")} == {first.name, second.name, made.path.name} | young
    assert garbage(filled) == ()


def tree(folder: Path) -> dict[str, str]:
    """Every file below a folder, hidden ones too, with its hash."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*")) if path.is_file()}  # fmt: skip


def strew(folder: Path) -> None:
    """Put somebody else's files into a folder, of every name that ours have, and old enough to go."""
    import h5py

    names = ("thesis_results.h5", "mine-0123456789abcdef.h5", "big.iso.partial", "mine-0123456789abcdef.h5.partial",
             "notes.h5.damaged", ".report.odt.7.writing", "half.writing", "text.h5")  # fmt: skip
    for place in (folder, folder / "tables", folder / "deep" / "runs"):
        place.mkdir(parents=True, exist_ok=True)
        for name in names:
            (place / name).write_bytes(b"somebody else's")
        with h5py.File(place / "measured.h5", "w") as file:
            file["x"] = np.arange(5.0)
        with h5py.File(place / "noted-0123456789abcdef.h5", "w") as file:  # speaks of us, and is not ours
            file.attrs["note"], file.attrs["tool"], file["format"] = "made with: iapb run peg_corner", "iapb run", 1
        (place / ".noted.h5.77.writing").write_bytes((place / "noted-0123456789abcdef.h5").read_bytes())
        (place / ".text.h5.77.writing").write_bytes(b"somebody else's")
        (place / ".twin.h5.77.writing").hardlink_to(place / "noted-0123456789abcdef.h5")
        (place / "link.h5").symlink_to(place / "thesis_results.h5")
    for path in folder.rglob("*"):
        if not path.is_symlink() and path.is_file():
            aged(path)


def test_nothing_of_somebody_elses_is_touched(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    strew(tmp_path / "theirs")
    before = tree(tmp_path)
    for words in (["gc", "--delete"], ["repair"], ["gc"], ["check"]):
        status = main(["store", words[0], str(tmp_path / "theirs"), *words[1:]])
        assert status == (1 if words[0] in ("gc", "repair") else 0)
    assert tree(tmp_path) == before and "a store of iapb" in capsys.readouterr().err


def test_nothing_of_somebody_elses_in_a_store_is_touched_either(filled: Path) -> None:
    spoilt = runs(filled)[0]
    mine = RunStore(filled / "runs", code="my law v1").put({"law": "mine"}, read_run(spoilt))
    strew(filled / "runs")
    before = tree(filled)
    store_run(filled / "runs" / "old-0000000000000000.h5", read_run(mine), key="0" * 64, code=OLDER)
    write_run(filled / "runs" / "of-no-code.h5", read_run(mine), key="1" * 64)  # as by a version that did not say it
    before |= {"runs/of-no-code.h5": tree(filled)["runs/of-no-code.h5"]}
    damage(spoilt)
    RunStore(filled / "runs")
    assert main(["store", "repair", str(filled)]) == 0
    assert main(["store", "gc", str(filled)]) == 0
    assert spoilt.with_name(spoilt.name + DAMAGED_SUFFIX).is_file()  # it only lists
    assert main(["store", "gc", str(filled), "--delete"]) == 0
    ours = {f"runs/{spoilt.name}": ""}  # the one that went
    assert {**tree(filled), **ours} == {**before, **ours}


def test_a_store_is_marked_when_it_is_written_to(filled: Path) -> None:
    (filled / "runs" / MARK_NAME).unlink()
    with pytest.raises(ArgumentError, match="a store of iapb"):
        garbage(filled)
    (filled / "runs" / MARK_NAME).write_text('{"format": "iapb store", "format_version": 2}')  # of a later version
    with pytest.raises(ArgumentError):
        repair_store(filled)
    (filled / "runs" / MARK_NAME).unlink()
    Runner(filled / "runs")(shipped_scene("peg_corner", SHORT), "CBuc")
    assert garbage(filled) == ()


@pytest.mark.parametrize("world", ["IAPB", "PB", "ideal", "CBuc", "IAPB-friction"])
def test_a_run_comes_out_the_same_from_its_own_file(tmp_path: Path, world: str) -> None:
    runner, scene = Runner(tmp_path), shipped_scene("peg_corner", {"duration": 0.2, "contact.friction": 0.2})
    runner(scene, world)
    repetition = repeat_run(next(tmp_path.glob("*.h5")))
    assert repetition.same and repetition.differs == ()


def test_a_run_that_does_not_come_out_the_same_is_told_with_what_differs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Runner(tmp_path)(shipped_scene("peg_corner", SHORT), "IAPB")
    energy = {**run.energy, "impact_loss": run.energy["impact_loss"] + 6e-17}
    other = {"blas": "OpenBLAS of another processor"}
    path = write_run(tmp_path / "forged.h5", replace(run, q=run.q + 1e-15, energy=energy), provenance=other)
    repetition = repeat_run(path)
    assert not repetition.same
    assert [one.name for one in repetition.differs] == ["trajectory/q", "energy/impact_loss"]
    assert [0.0 < one.largest < 2e-15 for one in repetition.differs] == [True, True]
    assert main(["store", "again", str(path)]) == 1
    said = capsys.readouterr().out
    assert "forged.h5: differs in\n" in said and "energy/impact_loss: by at most 6e-17 in " in said
    assert "stored under OpenBLAS of another processor; this is " in said


def _changed(values: np.ndarray) -> np.ndarray:
    return ~values if values.dtype == np.bool_ else values + values.dtype.type(1)


ARRAYS = [f"{group}/{quantity.name}" for group in RESULT_GROUPS for quantity in GROUPS[group][0]]


@pytest.mark.parametrize("name", ARRAYS)
def test_every_array_of_the_content_hash_is_compared(name: str, make_run: Callable[..., Run]) -> None:
    run, (group, field) = make_run(), name.split("/")
    record: Any = getattr(run, group) if group in ("contacts", "impacts") else run
    changed: Any = replace(record, **{field: _changed(getattr(record, field))})
    other = changed if record is run else replace(run, **{group: changed})
    assert content_hash(other) != content_hash(run)
    assert [one.name for one in differences(run, other)] == [name]


@pytest.mark.parametrize(
    ("field", "value", "how"),
    [
        ("complete", False, "is False, was True"),
        ("dt", 0.25, "is 0.25, was 0.001953125"),
        ("time", np.zeros(21), "by at most 0.039 in 20 of 21 values"),
        ("body_names", ("ball",), "is ('ball',), was ('peg',)"),
    ],
)
def test_so_is_what_stands_beside_the_arrays(field: str, value: object, how: str, make_run: Callable[..., Run]) -> None:
    run = make_run()
    other = replace(run, **{field: value})  # type: ignore[arg-type]
    assert content_hash(other) != content_hash(run)
    assert [(one.name, one.how) for one in differences(run, other)] == [(field, how)]


@pytest.mark.parametrize(
    ("stored", "again", "how"),
    [
        ([0.0, 1.0], [-0.0, 1.0], "in bits that no comparison of numbers shows (the sign of a zero, a NaN)"),
        ([np.nan, 1.0], [np.nan, 1.5], "by at most 0.5 in 1 of 2 values"),
        ([np.nan, 1.0], [2.0, 1.0], "by at most inf in 1 of 2 values"),
        ([1.0], [1.0, 1.0], "is float64 (2,), was float64 (1,)"),
    ],
)
def test_a_difference_says_how_large_it_is(
    stored: list[float], again: list[float], how: str, make_run: Callable[..., Run]
) -> None:
    runs = [make_run(energy={"kinetic": np.array(values)}) for values in (stored, again)]
    assert [(one.name, one.how) for one in differences(*runs)] == [("energy/kinetic", how)]
    assert differences(make_run(energy={}), make_run())[0].how == "only simulated again"


def test_a_run_that_cannot_be_made_again_costs_its_own_line(
    filled: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_run(filled / "mine.h5", replace(read_run(runs(filled)[0]), law="mine"))
    write_table(filled / "table.h5", Table("t", (Column("x", np.arange(3.0), "1", "x"),)))
    assert main(["store", "again", str(filled)]) == 1
    said = capsys.readouterr().out
    assert "mine.h5: not simulated again: law = 'mine'" in said and "table.h5" not in said
    assert f"{len(runs(filled))} of {len(runs(filled)) + 1} runs came out the same." in said


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
    assert main(["store", "check", str(filled)]) == 0
    assert main(["store", "again", str(runs(filled)[0])]) == 0
    assert "the same to the last bit" in capsys.readouterr().out
    damage(runs(filled)[0])
    assert main(["store", "check", str(filled)]) == 1
    assert main(["store", "repair", str(filled)]) == 0
    assert main(["store", "gc", str(filled)]) == 0
    assert any(name.endswith(DAMAGED_SUFFIX) for name in os.listdir(filled / "runs"))
    assert main(["store", "gc", str(filled), "--delete"]) == 0
    assert not any(name.endswith(DAMAGED_SUFFIX) for name in os.listdir(filled / "runs"))
    assert main(["store", "check", str(filled / "nowhere")]) == 1
