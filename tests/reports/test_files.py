"""Keys, files of runs and tables: the way there and back, what other programs see, what a damaged
file is worth."""

import dataclasses
import io
from functools import partial

import h5py
import numpy as np
import pytest
import xarray

from iapb.errors import ArgumentError, RunFileError
from iapb.scene import find_scene, load_scene, scene_names
from reference.worlds import run_world
from reports.provenance import collect_provenance
from reports.store import (
    content_hash,
    keys,
    read_provenance,
    read_run,
    run_key,
    write_run,
)
from reports.store.io import sealed
from reports.store.schema import FORMAT_VERSION
from tests.reports.made_up import made_run


def bits(value):
    """All of a value, by its types and to the last bit."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.shape, value.tobytes()
    if dataclasses.is_dataclass(value):
        return type(value), [
            (field.name, bits(getattr(value, field.name))) for field in dataclasses.fields(value)
        ]
    if isinstance(value, dict):
        value = list(value.items())
    if isinstance(value, tuple | list):
        return type(value), [bits(part) for part in value]
    return type(value), value


@pytest.mark.parametrize("name", scene_names())
def test_a_run_of_every_scene_comes_back_bit_for_bit(tmp_path, name):
    run = run_world(load_scene(find_scene(name)).with_values({"duration": 0.05}), "IAPB")
    assert bits(read_run(write_run(tmp_path / "run.h5", run))) == bits(run)


@pytest.mark.parametrize(
    "fields",
    [
        {"complete": False, "remarks": ("chosen",), "distrust": ("it sank é", "it flew")},
        {"energy": {}, "effects": ()},
        {"v": np.array([[np.nan, -0.0, np.inf]] * 206)},
    ],
)
def test_a_changed_run_comes_back_bit_for_bit(tmp_path, fields):
    run = made_run(**fields)
    assert bits(read_run(write_run(tmp_path / "run.h5", run))) == bits(run)


def test_a_run_saves_itself_and_replaces_a_file_only_if_asked(tmp_path):
    first = made_run()
    other = made_run(0.5)
    for run, replace, kept in ((first, False, first), (other, False, first), (other, True, other)):
        assert content_hash(
            read_run(run.save(tmp_path / "run.h5", replace=replace))
        ) == content_hash(kept)


def test_the_content_hash_is_that_of_the_results_alone(tmp_path):
    run = made_run()
    slower = dataclasses.replace(run, chunk_seconds=run.chunk_seconds * 3, kernel="python")
    assert content_hash(slower) == content_hash(run) == content_hash(made_run())
    with h5py.File(write_run(tmp_path / "a.h5", slower, provenance={"command": "other"})) as file:
        assert file.attrs["content_hash"] == content_hash(run)
    q = run.q.copy()
    q[3, 1] = np.nextafter(q[3, 1], np.inf)  # one unit in the last place
    assert content_hash(dataclasses.replace(run, q=q)) != content_hash(run)


def test_xarray_opens_it_with_units_and_dimensions_and_numbers_are_packed(tmp_path):
    run = made_run()
    path = write_run(tmp_path / "run.h5", run)
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        for node in tree.subtree:
            for name, variable in node.dataset.data_vars.items():
                where = f"{node.path}/{name}"
                assert not any(str(dim).startswith("phony") for dim in variable.dims), where
                assert variable.ndim == 0 or "units" in variable.attrs, where
        velocity = tree["trajectory/v"]
        assert velocity.dims == ("time", "velocity")
        assert velocity.attrs["units"] == "m/s, m/s, rad/s"
        np.testing.assert_array_equal(velocity.sel(velocity="peg.y"), run.v[:, 1])
        np.testing.assert_array_equal(tree["trajectory"].dataset["time"], run.time)
        assert str(tree["scene/source"].values) == run.scene_source

    def check(name, item):
        if isinstance(item, h5py.Dataset) and h5py.check_string_dtype(item.dtype) is None:
            assert item.shuffle and item.compression == "gzip", name

    with h5py.File(path) as file:
        file.visititems(check)


def edited(edit, whole):
    """The file after somebody else's program."""
    stream = io.BytesIO(whole)
    with h5py.File(stream, "a") as file:
        edit(file)
    return stream.getvalue()


def move(file):
    file["trajectory/q"][2, 1] += 1e-12


def of_version(version, whole):
    return sealed(edited(lambda file: file.attrs.update(format_version=version), whole))


def foreign(whole):
    return edited(lambda file: file.create_dataset("x", data=1), b"")


def flipped(whole):
    """Another byte in a chunk of numbers, under a seal that holds."""
    content = bytearray(whole)
    with h5py.File(io.BytesIO(whole)) as file:
        chunk = file["trajectory/q"].id.get_chunk_info(0)
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    return sealed(bytes(content))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (None, "no such file"),
        (lambda whole: b"", ""),
        (lambda whole: whole[: len(whole) // 2], ""),
        (lambda whole: b"time,x\n0,1\n", ""),
        (partial(of_version, FORMAT_VERSION - 1), ""),
        (foreign, "not written by iapb"),
        (flipped, "filter"),  # gzip's checksum
        (partial(edited, move), "differs from its seal"),
        (lambda whole: sealed(edited(move, whole)), "content hash"),
    ],
)
def test_other_contents_and_versions_are_refused_by_name(wrong, said, tmp_path):
    path = write_run(tmp_path / "run.h5", made_run())
    if wrong is None:
        path.unlink()
    else:
        path.write_bytes(wrong(path.read_bytes()))
    with pytest.raises(RunFileError, match=f"{path.name}.*{said}"):
        read_run(path)


def test_provenance_is_complete(tmp_path):
    facts = collect_provenance(seeds=(3, 4))
    assert read_provenance(write_run(tmp_path / "run.h5", made_run(), provenance=facts)) == facts
    assert all(facts[name] for name in ("version", "commit", "cpu", "blas", "seeds", "command"))


# What a key covers: every input, every line of code that can change a number, and no comment

INPUTS = {
    "scene": {"name": "peg", "rate": 512},
    "law": "IAPB",
    "settings": {"restitution": np.float64(0.0)},
}
CODE = '''"""What it does."""
LIMIT = 3.0  # [N]

@njit
def force(x):
    """Return the force."""
    return 2.0 * x
'''


def test_every_input_and_the_code_enter_the_key_but_not_order_and_type():
    changed = [
        INPUTS,
        INPUTS | {"law": "PB"},
        INPUTS | {"scene": {"name": "peg", "rate": 1000}},
        INPUTS | {"settings": {"restitution": 5e-324}},
        INPUTS | {"extra": None},
    ]
    assert (
        len({run_key(inputs) for inputs in changed} | {run_key(INPUTS, code="mine")})
        == len(changed) + 1
    )
    reordered = {
        "settings": {"restitution": 0.0},
        "law": "IAPB",
        "scene": {"rate": 512, "name": "peg"},
    }
    assert run_key(reordered) == run_key(INPUTS)
    with pytest.raises(ArgumentError, match="value"):
        run_key({"law": object()})


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("What it does.", "Does it.", True),
        ('    """Return the force."""\n', "", True),
        ("return 2.0 * x", "return (2.0\n            * x)", True),
        ("2.0 * x", "x * 2.0", False),
        ("@njit\n", "", False),
        ("LIMIT = 3.0", "LIMIT = 3", False),
    ],
)
def test_code_enters_a_key_and_words_do_not(old, new, same):
    assert old in CODE
    assert (
        keys.code_hash(CODE.replace(old, new).encode()) == keys.code_hash(CODE.encode())
    ) is same


def test_a_changed_added_or_removed_file_changes_the_key_whatever_is_remembered(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(keys, "_ROOT", tmp_path)
    monkeypatch.setattr(keys, "__file__", str(tmp_path / "keys.py"))
    folder = tmp_path / "engine"
    folder.mkdir()
    with pytest.raises(
        ArgumentError, match="engine"
    ):  # renamed, it would otherwise leave every key
        keys.sources_hash.__wrapped__("engine")

    def version(**files):
        for name, text in files.items():
            (folder / f"{name}.py").write_text(text)
        return str(keys.sources_hash.__wrapped__("engine"))

    first = version(a=CODE)
    found = [first, version(a=CODE.replace("2.0", "2.5")), version(b="")]
    (folder / "b.py").rename(folder / "c.py")
    assert len({*found, version()}) == 4
    (folder / "c.py").unlink()
    [kept] = tmp_path.rglob("code-*.json")
    for text in ("", "[1]", "{", '{"x": 1}'):
        kept.write_text(text)
        assert version(a=CODE.replace("Return", "Returns")) == first
    monkeypatch.setattr(keys, "code_hash", lambda source: pytest.fail("parsed again"))
    assert version() == first
