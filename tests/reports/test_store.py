"""Check of the store, and runs that come out the same again."""

import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

from iapb.errors import RunFileError
from reports.cli import main
from reports.evidence.runs import shipped_scene
from reports.resimulate import differences, repeat_run
from reports.runner import Runner
from reports.store import content_hash, read_run, write_run
from reports.store.check import (
    CHANGED,
    DAMAGED,
    FOREIGN,
    LEFTOVER,
    OPEN,
    OTHER,
    PARTIAL,
    WHOLE,
    check_store,
)
from reports.store.io import sealed
from reports.store.records import write_record
from reports.store.schema import FORMAT_VERSION, GROUPS
from tests.reports.made_up import made_run

SHORT = {"duration": 0.05}


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


def store(action, folder):
    return main(["store", action, str(folder)])


def test_every_kind_of_file_is_told_and_a_damaged_run_is_computed_again_where_it_was_removed(
    filled, capsys
):
    folder = filled / "runs"
    (spoilt, whole) = runs(filled)
    assert store("check", filled) == 0
    scene = shipped_scene("peg_corner", SHORT)
    run = read_run(spoilt)
    with h5py.File(spoilt, "r+") as file:
        move(file)
    write_run(whole.with_name("unfinished.h5.partial"), run)
    (folder / ".x.h5.1.writing").write_bytes(b"half")
    (folder / "text.h5").write_text("no HDF5")
    older = write_record(folder / "older.h5", 1, {})
    with h5py.File(older, "r+") as file:
        file.attrs["format_version"] = FORMAT_VERSION - 1
    older.write_bytes(sealed(older.read_bytes()))
    assert {state.path.name: state.state for state in check_store(filled)} == {
        spoilt.name: DAMAGED,
        whole.name: WHOLE,
        "unfinished.h5.partial": PARTIAL,
        ".x.h5.1.writing": LEFTOVER,
        "text.h5": FOREIGN,
        "older.h5": OTHER,
    }
    assert store("check", filled) == 1 and "Remove a damaged run" in capsys.readouterr().out
    with pytest.raises(RunFileError):
        Runner(folder)(scene, run.world)
    spoilt.unlink()
    assert content_hash(Runner(folder)(scene, run.world)) == content_hash(run) and spoilt.is_file()
    assert store("again", spoilt) == 0 and "the same to the last bit" in capsys.readouterr().out


def add_attribute(file):
    file.attrs["note"] = "mine"


def move(file):
    file["trajectory/q"][2, 1] += 1e-12


def slow_down(file):
    file.attrs["dt"] = 1.0


@pytest.mark.parametrize(
    ("edit", "state"),
    [
        (add_attribute, CHANGED),
        (slow_down, DAMAGED),
        (lambda file: file["steps"].create_dataset("mine", data=1), DAMAGED),
    ],
)
def test_what_another_program_writes_into_a_run_is_told_and_an_attribute_does_no_harm(
    tmp_path, edit, state
):
    path = tmp_path / "run.h5"
    run = made_run()
    write_run(path, run, provenance={})
    with h5py.File(path, "r+") as file:
        edit(file)
    assert [found.state for found in check_store(tmp_path)] == [state]
    with pytest.raises(RunFileError, match="differs from its seal.*iapb store check"):
        read_run(path)
    assert store("seal", path) == (state == DAMAGED)
    if state == CHANGED:
        assert content_hash(read_run(path)) == content_hash(run)
    assert check_store(tmp_path)[0].state == (WHOLE if state == CHANGED else DAMAGED)


def test_a_file_that_another_program_holds_open_is_not_damaged(tmp_path):
    path = write_run(tmp_path / "run.h5", made_run(), provenance={})
    with h5py.File(path, "r+") as file:
        add_attribute(file)
        file.flush()
        assert [one.state for one in check_store(tmp_path)] == [OPEN]
        with pytest.raises(RunFileError, match="another program holds it open"):
            read_run(path)
    with h5py.File(path):  # a reader disturbs nobody
        assert [one.state for one in check_store(tmp_path)] == [CHANGED]


@pytest.mark.parametrize("world", ["IAPB", "PB", "ideal", "CBuc", "IAPB-friction"])
def test_a_run_comes_out_the_same_from_its_own_file(tmp_path, world):
    Runner(tmp_path)(shipped_scene("peg_corner", {"duration": 0.2, "contact.friction": 0.2}), world)
    repetition = repeat_run(next(tmp_path.glob("*.h5")))
    assert repetition.same and repetition.differs == ()


def test_again_tells_what_differs_and_goes_on_past_what_cannot_be_made_again(filled, capsys):
    run = read_run(runs(filled)[0])
    energy = {**run.energy, "impact_loss": run.energy["impact_loss"] + 6e-17}
    forged = replace(run, q=run.q + 1e-15, energy=energy)
    path = write_run(filled / "forged.h5", forged, provenance={"blas": "another"})
    assert [one.name for one in repeat_run(path).differs] == ["trajectory/q", "energy/impact_loss"]
    assert all(0.0 < one.largest < 2e-15 for one in repeat_run(path).differs)
    write_run(filled / "mine.h5", replace(run, law="mine"))
    write_record(filled / "table.h5", 1, {})
    assert store("again", filled) == 1
    said = capsys.readouterr().out
    assert "energy/impact_loss: by at most 6e-17 in " in said and "table.h5" not in said
    assert "mine.h5: not simulated again: law = 'mine'" in said
    assert "2 of 4 runs came out the same." in said


def test_everything_of_the_content_hash_is_compared():
    run = made_run()
    others = {}
    for group in GROUPS.keys() - {"timings"}:
        for quantity in GROUPS[group][0]:
            record = getattr(run, group) if group in ("contacts", "impacts") else run
            old = getattr(record, quantity.name)
            new = ~old if old.dtype == np.bool_ else old + old.dtype.type(1)
            other = replace(record, **{quantity.name: new})
            others[f"{group}/{quantity.name}"] = (
                other if record is run else replace(run, **{group: other})
            )
    for field, value in (
        ("complete", False),
        ("dt", 0.25),
        ("time", 0.0 * run.time),
        ("body_names", ("ball",)),
    ):
        others[field] = replace(run, **{field: value})
    for name, one in others.items():
        assert content_hash(one) != content_hash(run) and [
            each.name for each in differences(run, one)
        ] == [name]


@pytest.mark.parametrize(
    ("stored", "again", "how"),
    [
        (
            [0.0, 1.0],
            [-0.0, 1.0],
            "in bits that no comparison of numbers shows (the sign of a zero, a NaN)",
        ),
        ([np.nan, 1.0], [np.nan, 1.5], "by at most 0.5 in 1 of 2 values"),
        ([np.nan, 1.0], [2.0, 1.0], "by at most inf in 1 of 2 values"),
        ([1.0], [1.0, 1.0], "is float64 (2,), was float64 (1,)"),
        (None, [1.0], "only simulated again"),
    ],
)
def test_a_difference_says_how_large_it_is(stored, again, how):
    pair = [
        made_run(energy={} if values is None else {"kinetic": np.array(values)})
        for values in (stored, again)
    ]
    assert [(one.name, one.how) for one in differences(*pair)] == [("energy/kinetic", how)]
