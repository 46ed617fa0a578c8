"""What may happen to a store, done to it: nothing finished is lost; and a careless writer would be caught."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import tests.robustness.faults as faults
from iapb.errors import RunFileError
from tests.robustness.faults import FAULTS, killed_writer, open_store
from tests.robustness.inputs import TIMES
from tests.robustness.kills import COMMANDS, FOREIGN, foreign_hash, killed_command, make_foreign

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("name", FAULTS)
def test_nothing_finished_is_lost(tmp_path: Path, name: str) -> None:
    rng = np.random.default_rng(0)
    for attempt in range(2 * TIMES):
        (tmp_path / str(attempt)).mkdir()
        FAULTS[name](tmp_path / str(attempt), rng)


@pytest.mark.parametrize("name", COMMANDS if TIMES > 1 else ["run", "sweep", "store gc"])
def test_a_killed_command_loses_nothing_and_touches_nothing_foreign(tmp_path: Path, name: str) -> None:
    killed_command(name, tmp_path, -(-TIMES // 4))


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
    with pytest.raises((AssertionError, RunFileError)):
        for attempt in range(3):
            (tmp_path / str(attempt)).mkdir()
            killed_writer(tmp_path / str(attempt), np.random.default_rng(attempt))
