"""Care of the store: damage is set aside, garbage goes, what is not ours stays, runs come out the same again."""

import fcntl
import io
import os
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.errors import ArgumentError, RunFileError
from reference import worlds
from reports.cli import main
from reports.evidence.runs import shipped_scene
from reports.evidence.stage import Stage
from reports.resimulate import differences, repeat_run
from reports.runner import Runner
from reports.store import RunStore, care, content_hash, read_run, write_run, write_table
from reports.store.care import DAMAGED, FOREIGN, LEFTOVER, PARTIAL, STALE, WHOLE, check_store, garbage
from reports.store.io import MARK_NAME, sealed
from reports.store.keys import SOURCES
from reports.store.parts import Parts
from reports.store.runs import store_run
from reports.store.schema import FORMAT_VERSION, GROUPS, RESULT_GROUPS
from reports.store.tables import write_record
from tests.reports.made_up import flipped, made_run
from verification.table import titled

SHORT = {"duration": 0.05}
OLDER = f"iapb {'0' * 64}"  # what a run of an older engine says of its code


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two")
    for world in ("IAPB", "PB"):
        Runner(folder / "runs")(shipped_scene("peg_corner", SHORT), world)
    return folder


@pytest.fixture
def filled(two_runs, tmp_path):
    """A store of two runs."""
    shutil.copytree(two_runs, tmp_path, dirs_exist_ok=True)
    return tmp_path


def runs(folder):
    return sorted((folder / "runs").glob("*.h5"))


def aged(path):
    """Older than any writer takes."""
    os.utime(path, (0, 0), follow_symlinks=False)
    return path


def store(action, folder):
    verb, *options = action.split()
    return main(["store", verb, str(folder), *options])


def test_every_kind_of_file_is_told_and_a_damaged_run_is_computed_again(filled, capsys):
    folder, (spoilt, whole) = filled / "runs", runs(filled)
    assert store("check", filled) == 0
    scene, run = shipped_scene("peg_corner", SHORT), read_run(spoilt)
    spoilt.write_bytes(flipped(spoilt.read_bytes()))
    write_run(whole.with_name("unfinished.h5.partial"), run)
    (folder / ".x.h5.1.writing").write_bytes(b"half")
    (folder / "text.h5").write_text("no HDF5")
    Parts(folder / "y.h5.parts", {}).close()
    os.truncate(folder / "y.h5.parts" / "00000000.part", 60)
    with h5py.File(folder / "other.h5", "w") as file:
        file["x"] = 1
    assert {state.path.name: state.state for state in check_store(filled)} == {
        spoilt.name: DAMAGED, whole.name: WHOLE, "unfinished.h5.partial": PARTIAL, ".x.h5.1.writing": LEFTOVER,
        "y.h5.parts": LEFTOVER, "text.h5": FOREIGN, "other.h5": FOREIGN}  # fmt: skip
    assert store("check", filled) == 1
    with pytest.raises(RunFileError):
        Runner(folder)(scene, run.world)
    assert store("repair", filled) == 0 and spoilt.exists()  # it may be somebody's work
    with h5py.File(spoilt.with_name("cut.h5"), "w") as file, h5py.File(whole) as other:
        file.attrs.update(other.attrs)  # ours, and not whole
    spoilt.write_bytes(sealed(spoilt.with_name("cut.h5").read_bytes()))
    spoilt.with_name("cut.h5").unlink()
    assert store("repair", filled) == 0
    aside = spoilt.with_name(spoilt.name + care.DAMAGED_SUFFIX)
    assert aside.is_file() and not spoilt.exists()
    assert content_hash(Runner(folder)(scene, run.world)) == content_hash(run) and spoilt.is_file()
    assert store("gc", filled) == 0 and aside.is_file()  # it only lists
    assert store("gc --delete", filled) == 0 and not aside.exists()
    assert store("check", filled / "nowhere") == 1
    assert store("again", spoilt) == 0 and "the same to the last bit" in capsys.readouterr().out


@pytest.mark.parametrize("version", [FORMAT_VERSION - 1, FORMAT_VERSION + 1])
def test_what_another_version_wrote_and_what_a_killed_writer_left_are_told_and_stay(filled, version, capsys):
    others = [runs(filled)[0], write_table(filled / "runs" / "table.h5", "t", titled(("x",), [(1.0,)]))]
    for path in others:
        with h5py.File(path, "r+") as file:
            file.attrs["format_version"] = version
        path.write_bytes(sealed(path.read_bytes()))
    half = runs(filled)[0].with_name(".x.h5.1.writing")
    half.write_bytes(runs(filled)[1].read_bytes()[:999])
    aged(half)
    for action in ("check", "repair", "gc --delete"):
        assert store(action, filled) == 0
    said = capsys.readouterr().out
    for path in others if version > FORMAT_VERSION else ():
        assert path.exists() and f"{path}: other version: its format has version {version}, and this iapb reads" in said
    assert f"{half}: leftover: half written, and nobody writes it; without a seal" in said and half.exists()
    with half.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert store("check", filled) == 0
    assert f"{half}: leftover: a process is writing it" in capsys.readouterr().out
    assert store("check", others[0]) == 1


def test_garbage_is_what_no_present_code_asks_for(filled):
    assert garbage(filled) == ()
    folder, (first, second) = filled / "runs", runs(filled)
    run = read_run(first)
    store_run(folder / "old-0000000000000000.h5", run, key="0" * 64, code=OLDER)
    for name, code in (("old", OLDER), (first.stem, ""), ("mine", ""), ("young", OLDER)):
        Parts(folder / f"{name}.h5.parts", {"code": code}).close()
        if name != "young":
            aged(folder / f"{name}.h5.parts")
    for name, content in ((".y.h5.1.writing", second.read_bytes()), (".young.h5.1.writing", b""),
                          (".half.h5.1.writing", b"")):  # fmt: skip
        (folder / name).write_bytes(content)
    aged(folder / ".half.h5.1.writing")
    for path in (first, second):
        write_run(path.with_name(path.name + ".partial"), run)
    aged(folder / ".y.h5.1.writing"), aged(first.with_name(first.name + ".partial"))
    made = Stage(filled / "tables", "cost", tuple[float, ...], "quick", {"a package": "2.1"})
    made.fill(Runner(filled.with_name("others")), lambda failures: (1.0,))
    write_record(filled / "tables" / "claims-0123456789abcdef.h5", 1, "", provenance={SOURCES: "older code"})
    found = garbage(filled)
    assert sorted(state.state for state in found) == sorted([STALE, LEFTOVER, LEFTOVER, LEFTOVER, PARTIAL, STALE])
    care.collect_garbage(found)
    young = {".half.h5.1.writing", ".young.h5.1.writing", second.name + ".partial", "mine.h5.parts", "young.h5.parts"}
    assert {path.name for path in filled.rglob("*.h5*")} == {first.name, second.name, made.path.name} | young
    assert garbage(filled) == ()


def test_a_partial_run_is_no_garbage_where_the_finished_one_is_damaged(filled):
    whole = runs(filled)[0]
    partial = aged(write_run(whole.with_name(whole.name + ".partial"), read_run(whole)))
    assert [state.path for state in garbage(filled)] == [partial]
    whole.write_bytes(whole.read_bytes()[:-100])
    assert garbage(filled) == ()


def tree(folder):
    """Everything below a folder, hidden files too."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() and not path.is_symlink()
            else path.lstat().st_mode for path in folder.rglob("*")}  # fmt: skip


def strew(folder, run, first):
    """Put somebody else's and damaged files into a folder, of every name that ours have, and old enough to go."""
    part, noted = b'{"format": "iapb part"', io.BytesIO()
    with h5py.File(noted, "w") as file:  # speaks of us, and is not ours
        file.attrs.update({"format": "a note", "format_version": 4, "tool": "made with: iapb run peg_corner"})
    noted = noted.getvalue()
    contents = (noted, b"somebody else's", flipped(run), b"", run[: len(run) // 2], run[:-91], sealed(noted),
                sealed(b"text"), part, sealed(b"x" + part), bytes(range(256)), b"\x89HDF\r\n\x1a\n", run + b"more")
    names = ("{}.h5", "mine{}-0123456789abcdef.h5", ".x{}.h5.77.writing", "big{}.iso.partial", "x{}.h5.damaged",
             "mine{}-0123456789abcdef.h5.partial", "mine{}-0123456789abcdef.h5.damaged", "notes{}.txt",
             ".iapb-store.json.{}.writing", ".0000000{}.part.7.writing", "{}.h5.parts/00000001.part",
             "{}.h5.parts/lock", "{}.h5.parts/00000000.part", "{}.h5.parts/.00000000.part.7.writing",
             "mine{}.writing", ".report{}.odt.7.writing")  # fmt: skip
    for place in (folder, folder / "deep" / "runs"):
        for number, content in enumerate(contents[: first if place == folder else 1]):
            for name in names:
                path = place / name.format(number)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        (place / ".twin.h5.77.writing").hardlink_to(folder / "1.h5")
        (place / "link.h5").symlink_to(place / "0.h5")
        (place / "new\nline.h5").write_bytes(flipped(run))
        os.mkfifo(place / "pipe.h5")
        os.mkfifo(place / ".p.h5.1.writing")
    for path in folder.rglob("*"):
        aged(path)


@pytest.mark.parametrize("contents", [2, pytest.param(13, marks=pytest.mark.thorough)])
def test_nothing_of_somebody_elses_is_touched(filled, contents, capsys):
    spoilt = runs(filled)[0]
    whole = spoilt.read_bytes()
    strew(filled / "theirs", whole, contents)
    before = tree(filled)
    assert [store(action, filled / "theirs") for action in ("gc --delete", "repair", "check")] == [1, 1, 1]
    said = capsys.readouterr()
    assert tree(filled) == before and "a store of iapb" in said.err and "\nline.h5" not in said.out
    mine = RunStore(filled / "runs", code="my law v1").put({"law": "mine"}, read_run(spoilt))
    write_run(filled / "runs" / "of-no-code.h5", read_run(mine), key="1" * 64)  # as by a version that did not say it
    strew(filled / "runs", whole, contents)
    before = tree(filled)
    store_run(filled / "runs" / "old-0000000000000000.h5", read_run(mine), key="0" * 64, code=OLDER)
    spoilt.write_bytes(flipped(whole))
    assert [store(action, filled) for action in ("check", "repair", "gc", "gc --delete")] == [1, 0, 0, 0]
    assert store("again", filled / "runs") == 1 == main(["certify", str(filled / "runs")])
    RunStore(filled / "runs")
    before[f"runs/{spoilt.name}"] = spoilt.read_bytes()
    assert tree(filled) == before and "\nline.h5" not in "".join(capsys.readouterr())


def test_a_store_is_marked_when_it_is_written_to(filled):
    mark = filled / "runs" / MARK_NAME
    for later in (None, '{"format": "iapb store", "format_version": 2}'):
        mark.unlink(missing_ok=True)
        if later:
            mark.write_text(later)
        with pytest.raises(ArgumentError, match="a store of iapb"):
            garbage(filled)
    mark.unlink()
    Runner(filled / "runs")(shipped_scene("peg_corner", SHORT), "CBuc")
    assert garbage(filled) == ()


@pytest.mark.parametrize("world", ["IAPB", "PB", "ideal", "CBuc", "IAPB-friction"])
def test_a_run_comes_out_the_same_from_its_own_file(tmp_path, world):
    Runner(tmp_path)(shipped_scene("peg_corner", {"duration": 0.2, "contact.friction": 0.2}), world)
    repetition = repeat_run(next(tmp_path.glob("*.h5")))
    assert repetition.same and repetition.differs == ()


def test_again_tells_what_differs_and_goes_on_past_what_cannot_be_made_again(filled, capsys):
    run = read_run(runs(filled)[0])
    energy = {**run.energy, "impact_loss": run.energy["impact_loss"] + 6e-17}
    forged = replace(run, q=run.q + 1e-15, energy=energy)
    path = write_run(filled / "forged.h5", forged, provenance={"blas": "OpenBLAS of another processor"})
    assert [one.name for one in repeat_run(path).differs] == ["trajectory/q", "energy/impact_loss"]
    assert all(0.0 < one.largest < 2e-15 for one in repeat_run(path).differs)
    write_run(filled / "mine.h5", replace(run, law="mine"))
    write_table(filled / "table.h5", "t", titled(("x",), [(1.0,)]))
    assert store("again", filled) == 1
    said = capsys.readouterr().out
    assert "forged.h5: differs in\n" in said and "energy/impact_loss: by at most 6e-17 in " in said
    assert "stored under OpenBLAS of another processor; this is " in said and "table.h5" not in said
    assert "mine.h5: not simulated again: law = 'mine'" in said and "2 of 4 runs came out the same." in said


def test_a_law_of_ones_own_is_made_again_where_a_world_has_it(tmp_path, monkeypatch):
    class Mine(Penalty):
        name = "springs of mine"

    monkeypatch.setitem(worlds.WORLDS, "mine", lambda rendering: worlds.World("mine", Mine(), "four-channel"))
    Runner(tmp_path)(shipped_scene("peg_corner", SHORT), "mine")
    path = next(tmp_path.glob("*.h5"))
    assert repeat_run(path).same
    monkeypatch.setattr(Mine, "settings", {"stiffness": "another"})
    with pytest.raises(ArgumentError, match="springs of mine"):
        repeat_run(path)


def test_everything_of_the_content_hash_is_compared():
    run, others = made_run(), {}
    for group in RESULT_GROUPS:
        for quantity in GROUPS[group][0]:
            record = getattr(run, group) if group in ("contacts", "impacts") else run
            old = getattr(record, quantity.name)
            new = ~old if old.dtype == np.bool_ else old + old.dtype.type(1)
            other = replace(record, **{quantity.name: new})
            others[f"{group}/{quantity.name}"] = other if record is run else replace(run, **{group: other})
    for field, value in (("complete", False), ("dt", 0.25), ("time", np.zeros(21)), ("body_names", ("ball",))):
        others[field] = replace(run, **{field: value})
    for name, one in others.items():
        assert content_hash(one) != content_hash(run) and [each.name for each in differences(run, one)] == [name]


@pytest.mark.parametrize(("stored", "again", "how"), [
    ([0.0, 1.0], [-0.0, 1.0], "in bits that no comparison of numbers shows (the sign of a zero, a NaN)"),
    ([np.nan, 1.0], [np.nan, 1.5], "by at most 0.5 in 1 of 2 values"),
    ([np.nan, 1.0], [2.0, 1.0], "by at most inf in 1 of 2 values"),
    ([1.0], [1.0, 1.0], "is float64 (2,), was float64 (1,)"), (None, [1.0], "only simulated again"),
])  # fmt: skip
def test_a_difference_says_how_large_it_is(stored, again, how):
    pair = [made_run(energy={} if values is None else {"kinetic": np.array(values)}) for values in (stored, again)]
    assert [(one.name, one.how) for one in differences(*pair)] == [("energy/kinetic", how)]
