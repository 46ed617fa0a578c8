"""The store: what is there is not computed again, what is finished is not overwritten, what is killed is readable."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from iapb.errors import ArgumentError, RunFileError
from iapb.run import Run
from reports.store import RunStore, content_hash, read_run
from reports.store.io import mark_store, sealed

MakeRun = Callable[..., Run]
INPUTS = {"scene": {"name": "peg", "rate": 512}, "law": "IAPB"}


def never() -> Run:
    pytest.fail("computed again")


def test_a_finished_run_is_neither_computed_again_nor_overwritten(tmp_path: Path, make_run: MakeRun) -> None:
    store, run = RunStore(tmp_path), make_run()
    assert store.get_or_run(INPUTS, lambda: run, label="peg corner/IAPB") is run
    assert content_hash(RunStore(tmp_path).get_or_run(INPUTS, never, label="any other label")) == content_hash(run)
    [path] = tmp_path.glob("*.h5")
    before = path.read_bytes()
    assert store.put(INPUTS, make_run(seed=2)) == path and path.read_bytes() == before
    path.write_bytes(before[:5000])
    with pytest.raises(RunFileError, match=path.name):  # damage is reported, and left where it is
        store.get_or_run(INPUTS, never)
    assert path.stat().st_size == 5000


def test_an_interrupted_run_is_kept_as_partial_and_finished_later(tmp_path: Path, make_run: MakeRun) -> None:
    store = RunStore(tmp_path)
    interrupted, place = make_run(steps=10, complete=False), store.place_of(INPUTS)
    assert not store.get_or_run(INPUTS, lambda: interrupted).complete
    assert read_run(place.partial).steps == 10 and not place.path.exists()
    with pytest.raises(ArgumentError, match="complete"):
        store.put(INPUTS, interrupted)
    assert store.get_or_run(INPUTS, make_run).complete
    assert not place.partial.exists() and place.path.is_file()


def test_what_a_killed_writer_left_aside_is_removed_once_it_is_old(tmp_path: Path) -> None:
    old, young, theirs = (tmp_path / name for name in (".a.h5.1.writing", ".b.h5.2.writing", ".c.odt.1.writing"))
    for path in (old, young, theirs):
        path.write_bytes(sealed(b'{"format": "iapb part"'))
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
    (tmp_path / "other.h5").write_text("no run")
    assert [entry.title for entry in store.entries()] == ["peg · IAPB", "peg · PB"]
    assert store.entries()[0].content_hash == content_hash(make_run())
    (tmp_path / store.entries()[0].file).unlink()
    assert [entry.title for entry in store.entries()] == ["peg · PB"]
