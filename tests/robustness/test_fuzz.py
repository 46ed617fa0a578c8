"""Wrong input of every kind: read, or refused by one of iapb's errors; never a traceback, a hang or a crash."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from iapb.errors import IapbError
from tests.robustness.damage import Rng
from tests.robustness.fuzz import BROKEN, READ, REFUSED, fuzz, judge, main
from tests.robustness.inputs import KINDS, Kind, prepare

CASES = {"scenes": 300, "sealed run files": 60, "command lines": 60, "parts of killed runs": 60}
OTHERS = 200  # of the kinds that cost less


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_wrong_input_is_read_or_refused_and_valid_input_is_read(kind: str, tmp_path: Path) -> None:
    prepare(tmp_path)
    for name, content in KINDS[kind].samples().items():
        outcome, words = judge(KINDS[kind].read, tmp_path / name, content)
        assert outcome == READ or kind == "command lines", words  # some lines are wrong on purpose
    outcomes, broken = fuzz(kind, range(CASES.get(kind, OTHERS)), 0, tmp_path)
    assert not broken, broken[0]
    assert outcomes[REFUSED] >= outcomes.total() // 4, "damage too mild to try anything"


def test_a_careless_reader_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted faults: a traceback and a swallowed hang; and one that is right."""
    def careless(path: Path) -> None:
        raise KeyError(path.name)

    def endless(path: Path) -> None:
        while True:
            try:
                sum(range(1000))
            except Exception:
                continue

    def polite(path: Path) -> None:
        raise IapbError("no")

    monkeypatch.setattr("tests.robustness.fuzz.LONGEST", 0.1)
    assert [judge(reader, tmp_path / "x", b"")[0] for reader in (careless, endless, polite)] == [
        BROKEN, BROKEN, REFUSED]  # fmt: skip


def number_of_case(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return bytes([int(rng.integers(4))])


def fragile(path: Path) -> None:
    """Ends the process on one content in four, and raises on another."""
    content = path.read_bytes()
    if content == b"\0":
        os._exit(11)
    if content == b"\1":
        raise KeyError("one")


def test_a_reader_that_kills_its_process_is_found_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planted = {"fragile": Kind("fragile", lambda: {"x": b""}, number_of_case, fragile)}
    monkeypatch.setattr("tests.robustness.fuzz.KINDS", planted)
    assert main(["--cases", "12", "--keep", str(tmp_path)]) == 1
    kept = [path.read_bytes() for path in (tmp_path / "fragile").iterdir()]
    killed, raised = kept.count(b"\0"), kept.count(b"\1")
    assert killed and raised and len(kept) == killed + raised
    out = capsys.readouterr().out
    assert f"{len(kept)} broken" in out and "the process ended" in out and "12 tried" in out
