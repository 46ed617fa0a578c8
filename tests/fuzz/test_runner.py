"""`make fuzz`: what breaks is kept, and a reader that takes its process down is found and gone past."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import reports.fuzz.__main__ as runner
import reports.fuzz.kinds as kinds_of_input
from reports.fuzz.kinds import Kind
from reports.fuzz.mutate import Rng


def number_of_case(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return bytes([int(rng.integers(4))])


def fragile(path: Path) -> None:
    """Ends the process on one content in four, and raises on another."""
    content = path.read_bytes()
    if content == b"\0":
        os._exit(11)
    if content == b"\1":
        raise KeyError("one")


def test_a_reader_that_kills_its_process_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planted = {"fragile": Kind("fragile", lambda: {"x": b""}, number_of_case, fragile)}
    for place in (runner, kinds_of_input):
        monkeypatch.setattr(place, "kinds", lambda: planted)
    assert runner.main(["--cases", "12", "--keep", str(tmp_path)]) == 1
    kept = [path.read_bytes() for path in (tmp_path / "fragile").glob("*-x")]
    killed, raised = kept.count(b"\0"), kept.count(b"\1")
    assert killed and raised and len(kept) == killed + raised
    out = capsys.readouterr().out
    assert f"{len(kept)} broken" in out and "ended with 11" in out


def test_nothing_broken_ends_with_0(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert runner.main(["--cases", "20", "--kind", "LCP and MLCP files", "--keep", str(tmp_path)]) == 0
    assert "0 broken" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())
