"""Two processes that write the same runs into one store at the same time."""

from __future__ import annotations

from pathlib import Path

from reports.faults.sample import in_child, inputs_of, numbered, open_store, sample_run, whole
from reports.store.care import WHOLE, check_store

_RUNS = 3  # per attempt


def rival_writers(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Both store the same runs; afterwards each run is there once, whole, and in the index once."""
    sample_run()
    survived, lost = 0, 0
    for attempt in range(times):
        place = folder / str(attempt)
        store = open_store(place)
        writers = [in_child(_write, place) for _ in range(2)]
        for writer in writers:
            writer.join()
        missing = sum(not whole(store, number) for number in range(_RUNS))
        sound = {state.state for state in check_store(place)} == {WHOLE} and len(store.entries()) == _RUNS
        lost += missing
        survived += missing == 0 and sound and all(writer.exitcode == 0 for writer in writers)
    return times, survived, lost, "nothing: the first to finish wins, the other finds the run there"


def _write(folder: Path) -> None:
    store = open_store(folder)
    for number in range(_RUNS):
        store.put(inputs_of(number), numbered(number), "sample")
