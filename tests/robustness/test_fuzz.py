"""Wrong input of every kind: read, or refused by one of iapb's errors; never a traceback, a hang or a crash."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from iapb.errors import IapbError
from tests.robustness.damage import Rng
from tests.robustness.fuzz import BROKEN, case, fuzz, judge, main
from tests.robustness.inputs import KINDS, Kind, prepare

CASES = {"scenes in the plane": 200, "scenes in space": 100, "sealed run files": 60, "command lines": 60,
         "logs of killed runs": 60}
OTHERS = 200  # of the kinds that cost less


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_wrong_input_is_read_or_refused(kind: str) -> None:
    record = fuzz(kind, range(CASES.get(kind, OTHERS)))
    assert not record.broken, record.broken[0]
    assert record.read + record.refused == record.tried
    assert record.refused >= record.tried // 4, "damage too mild to try anything"


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_valid_input_is_read(kind: str, tmp_path: Path) -> None:
    """So the refusals above are the damage's, not the samples'."""
    prepare(tmp_path)
    for name, content in KINDS[kind].samples().items():
        (tmp_path / name).write_bytes(content)
        if kind != "command lines":  # some of which are wrong on purpose
            KINDS[kind].read(tmp_path / name)


def test_a_case_is_the_same_again() -> None:
    kind = KINDS["scenes in the plane"]
    assert case(kind, 0, 7) == case(kind, 0, 7) != case(kind, 1, 7)


def test_a_careless_reader_is_caught(tmp_path: Path) -> None:
    """The planted faults: a traceback, a swallowed hang, memory without end; and one that is right."""

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

    def judged(reader: object) -> str:
        return judge(Kind("x", dict, lambda *_: b"", reader), tmp_path / "x", b"")[0]  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tests.robustness.fuzz.LONGEST", 0.1)
        assert judged(careless) == BROKEN
        assert judged(endless) == BROKEN
    assert judged(polite) == "refused"


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
    monkeypatch.setattr("tests.robustness.fuzz.KINDS", planted)
    assert main(["--cases", "12", "--keep", str(tmp_path)]) == 1
    kept = [path.read_bytes() for path in (tmp_path / "fragile").glob("*-x")]
    killed, raised = kept.count(b"\0"), kept.count(b"\1")
    assert killed and raised and len(kept) == killed + raised
    out = capsys.readouterr().out
    assert f"{len(kept)} broken" in out and "ended with 11" in out


def test_nothing_broken_ends_with_0(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["--cases", "20", "--kind", "LCP and MLCP files", "--keep", str(tmp_path)]) == 0
    assert "0 broken" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())
