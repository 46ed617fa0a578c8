"""The store: what is there is not computed again, what is finished is not overwritten, what is killed is readable."""

from __future__ import annotations

import collections
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError, RunFileError
from iapb.run import Run
from reports.store import RunStore, folder, io, read_run, run_key, runs
from reports.store.io import mark_store
from reports.store.keys import content_hash

MakeRun = Callable[..., Run]
INPUTS = {"scene": {"name": "peg", "rate": 512}, "law": "IAPB", "settings": {"restitution": np.float64(0.0)}}


class Counter:
    """A computation that counts its calls."""

    def __init__(self, run: Run) -> None:
        self.run, self.calls = run, 0

    def __call__(self) -> Run:
        self.calls += 1
        return self.run


def test_a_run_that_exists_is_not_computed_again(tmp_path: Path, make_run: MakeRun) -> None:
    compute = Counter(make_run())
    first = RunStore(tmp_path).get_or_run(INPUTS, compute, label="peg corner/IAPB")
    again = RunStore(tmp_path).get_or_run(INPUTS, compute, label="any other label")
    assert compute.calls == 1 and content_hash(first) == content_hash(again)
    assert len(list(tmp_path.glob("*.h5"))) == 1


@pytest.mark.parametrize(
    "change",
    [{"law": "PB"}, {"scene": {"name": "peg", "rate": 1000}}, {"settings": {"restitution": 5e-324}}, {"extra": None}],
)
def test_any_input_changes_the_key(change: dict[str, object]) -> None:
    assert run_key({**INPUTS, **change}) != run_key(INPUTS)


def test_the_key_forgets_order_and_number_type_but_not_the_code() -> None:
    reordered = {"settings": {"restitution": 0.0}, "law": "IAPB", "scene": {"rate": 512, "name": "peg"}}
    assert run_key(reordered) == run_key(INPUTS)
    assert run_key(INPUTS, code="mine 1") != run_key(INPUTS, code="mine 2")


def test_an_input_that_has_no_text_is_refused() -> None:
    with pytest.raises(ArgumentError, match="value"):
        run_key({"law": object()})


def test_a_finished_run_is_never_overwritten(tmp_path: Path, make_run: MakeRun) -> None:
    store = RunStore(tmp_path)
    path = store.put(INPUTS, make_run(seed=1))
    before = path.read_bytes()
    assert store.put(INPUTS, make_run(seed=2)) == path
    assert path.read_bytes() == before


def test_a_damaged_run_is_reported_and_left_where_it_is(tmp_path: Path, make_run: MakeRun) -> None:
    store = RunStore(tmp_path)
    path = store.put(INPUTS, make_run())
    path.write_bytes(path.read_bytes()[:5000])
    compute = Counter(make_run())
    with pytest.raises(RunFileError, match=path.name):
        store.get_or_run(INPUTS, compute)
    assert compute.calls == 0 and path.stat().st_size == 5000


def test_an_interrupted_run_is_kept_as_partial_and_finished_later(tmp_path: Path, make_run: MakeRun) -> None:
    store = RunStore(tmp_path)
    interrupted, place = Counter(make_run(steps=10, complete=False)), store.place_of(INPUTS)
    assert not store.get_or_run(INPUTS, interrupted).complete
    assert read_run(place.partial).steps == 10 and not place.path.exists()
    with pytest.raises(ArgumentError, match="complete"):
        store.put(INPUTS, interrupted.run)
    assert store.get_or_run(INPUTS, Counter(make_run())).complete
    assert not place.partial.exists() and place.path.is_file()


def test_a_new_run_has_its_key_and_hash_taken_once_and_its_file_not_read_back(
    tmp_path: Path, make_run: MakeRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = collections.Counter[str]()
    for place, name in ((folder, "run_key"), (runs, "content_hash"), (runs, "opened"), (RunStore, "place_of"),
                        (io, "sealed"), (io, "_checksum")):  # fmt: skip
        monkeypatch.setattr(place, name, _counted(calls, name, getattr(place, name)))
    store = RunStore(tmp_path)
    store.get_or_run(INPUTS, Counter(make_run()))
    assert calls == {"run_key": 1, "place_of": 1, "content_hash": 1, "sealed": 1}  # its bytes are hashed once
    store.get_or_run(INPUTS, Counter(make_run()))  # reads: opened once, judged once
    assert calls == {"run_key": 2, "place_of": 2, "content_hash": 2, "sealed": 1, "opened": 1, "_checksum": 1}
    assert len(store.entries()) == 1


def _counted(calls: collections.Counter[str], name: str, function: Any) -> Any:
    def call(*arguments: Any, **options: Any) -> Any:
        calls[name] += 1
        return function(*arguments, **options)

    return call


def test_what_a_killed_writer_left_aside_is_removed_once_it_is_old(tmp_path: Path) -> None:
    old, young, theirs = (tmp_path / name for name in (".a.h5.1.writing", ".b.h5.2.writing", ".c.odt.1.writing"))
    for path in (old, young, theirs):
        path.write_text("")
        os.utime(path, None if path == young else (0, 0))
    RunStore(tmp_path)
    assert old.exists()  # nobody has said that this is a store
    mark_store(tmp_path)
    RunStore(tmp_path)
    assert not old.exists() and young.exists() and theirs.exists()


def test_the_entries_are_those_of_the_files(tmp_path: Path, make_run: MakeRun) -> None:
    store = RunStore(tmp_path)
    for world in ("IAPB", "PB"):
        store.put({"world": world}, make_run(world=world), label=world)
    assert [entry.title for entry in store.entries()] == ["peg · IAPB", "peg · PB"]
    assert store.entries()[0].content_hash == content_hash(make_run())
    (tmp_path / store.entries()[0].file).unlink()
    assert [entry.title for entry in store.entries()] == ["peg · PB"]
