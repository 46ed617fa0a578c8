"""What may happen to a store, done to it: nothing finished is lost; and a careless writer would be caught."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import tests.robustness.faults as faults
from tests.robustness.faults import FAULTS, do_fault, open_store
from tests.robustness.kills import FOREIGN, foreign_hash, killed_command, make_foreign


@pytest.mark.parametrize("name", FAULTS)
def test_nothing_finished_is_lost(tmp_path: Path, name: str) -> None:
    tried, survived, lost, said = do_fault(name, tmp_path, 2)
    assert (survived, lost) == (tried, 0) and said


@pytest.mark.parametrize("name", ["run", "sweep", "store gc"])
def test_a_killed_command_loses_nothing_and_touches_nothing_foreign(tmp_path: Path, name: str) -> None:
    tried, survived, lost, _ = killed_command(name, tmp_path, 1)
    assert (tried, survived, lost) == (1, 1, 0)


def test_a_change_of_a_foreign_file_and_a_writer_in_place_would_be_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_foreign(tmp_path)
    before = foreign_hash(tmp_path)
    (tmp_path / FOREIGN[-1]).unlink()
    assert foreign_hash(tmp_path) != before

    def careless(folder: Path) -> None:
        """The planted fault: straight into the target, unsynced and unsealed, said to be finished beforehand."""
        with open_store(folder).place_of({"number": 0}, "sample").path.open("wb") as file:
            (folder / "finished").write_text("0\n")
            while True:
                file.write(b"\x89HDF\r\n\x1a\n" * 100)
                file.flush()
                time.sleep(1e-3)

    monkeypatch.setattr(faults, "write_for_ever", careless)
    assert do_fault("kill -9 at a random moment", tmp_path / "careless", 3)[1] < 3
