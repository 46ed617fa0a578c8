"""Wrong input of every kind: read, or refused by one of iapb's errors; never a traceback, a hang or a crash."""

from __future__ import annotations

from pathlib import Path

import pytest

from iapb.errors import IapbError
from reports.fuzz import fuzz
from reports.fuzz.kinds import Kind, kinds
from reports.fuzz.trial import BROKEN, case, judge

CASES = {"scenes in the plane": 200, "scenes in space": 100, "sealed run files": 60, "command lines": 60}
OTHERS = 200  # of the kinds that cost less


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_wrong_input_is_read_or_refused(kind: str) -> None:
    record = fuzz(kind, range(CASES.get(kind, OTHERS)))
    assert not record.broken, f"{record.broken[0]}\n{record.broken[0].how}"
    assert record.read + record.refused == record.tried
    assert record.refused >= record.tried // 4, "damage too mild to try anything"


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_valid_input_is_read(kind: str, tmp_path: Path) -> None:
    """So the refusals above are the damage's, not the samples'."""
    from reports.fuzz.kinds import prepare

    prepare(tmp_path)
    for name, content in kinds()[kind].samples().items():
        (tmp_path / name).write_bytes(content)
        if kind != "command lines":  # some of which are wrong on purpose
            kinds()[kind].read(tmp_path / name)


def test_a_case_is_the_same_again() -> None:
    kind = kinds()["scenes in the plane"]
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
        patch.setattr("reports.fuzz.trial.LONGEST", 0.1)
        assert judged(careless) == BROKEN
        assert judged(endless) == BROKEN
    assert judged(polite) == "refused"
