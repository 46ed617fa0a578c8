"""RunStore: a folder of runs, one HDF5 file each; no run is computed twice.

    store = RunStore("out/runs")
    run, entry = store.fetch(store.place_of(inputs), lambda: simulate(scene, law))

A file is named by a label and its run key, the hash of everything that determines the run. A run
that gave up is stored as ``<name>.h5.partial``, for readers, and is computed again next time. A
finished file is never written again.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from iapb.errors import ArgumentError, RunFileError
from iapb.run import Run
from reports.store.keys import run_key
from reports.store.runs import RunEntry, read_entry, read_stored, store_run

PARTIAL_SUFFIX = ".partial"
# 64 bits: a collision among a million runs has a probability below 1e-7; the file has all 256 bits
_KEY_DIGITS = 16


class Place(NamedTuple):
    """The place of a run in a store: its key, and its file."""

    key: str
    path: Path

    @property
    def partial(self) -> Path:
        """Return the file of an unfinished run."""
        return self.path.with_name(self.path.name + PARTIAL_SUFFIX)


class RunStore:
    """A folder of runs.

    Parameters
    ----------
    folder
        Folder of the runs; it is created if it does not exist.
    code
        Code version that enters the run keys; by default a hash of the engine's and the references'
        sources. For runs with your own law, add the version of the law here or in the inputs.
    """

    def __init__(self, folder: Path | str, code: str | None = None) -> None:
        self.folder = Path(folder)
        self.code = code
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunFileError(
                f"{self.folder}: cannot be a folder of runs: {error.strerror or error}"
            ) from error

    def place_of(self, inputs: Mapping[str, Any], label: str = "run") -> Place:
        """Return the key of `inputs`, and the file that their run has or will have.

        The file name starts with `label`. The label is not part of the key: a run is found under
        any label.
        """
        key = run_key(inputs, self.code)
        word = re.sub(r"[^A-Za-z0-9._]+", "-", label).strip("-.") or "run"
        path = self.folder / f"{word}-{key[:_KEY_DIGITS]}.h5"
        return Place(
            key,
            path
            if path.is_file()
            else min(self.folder.glob(f"*-{key[:_KEY_DIGITS]}.h5"), default=path),
        )

    def fetch(self, place: Place, compute: Callable[[], Run]) -> tuple[Run, RunEntry]:
        """Return the run of a place and the entry of its file: read it, or compute and store it.

        The run has ``complete=False`` if `compute` gave up early. Then it is stored as partial and
        computed again next time.

        Raises
        ------
        RunFileError
            The file is damaged. A damaged file is not replaced automatically: remove it to compute
            the run again.
        """
        if place.path.is_file():
            run, entry = read_stored(place.path)
            if entry.run_key != place.key:
                raise RunFileError(
                    f"{place.path}: run key is {entry.run_key}: expected {place.key}"
                )
            return run, entry
        run = compute()
        if not isinstance(run, Run):
            raise ArgumentError("compute", run, "a function that returns a Run")
        return run, self._keep(place, run)

    def _keep(self, place: Place, run: Run) -> RunEntry:
        if not run.complete:
            return store_run(place.partial, run, key=place.key, replace=True)
        entry = store_run(place.path, run, key=place.key)
        place.partial.unlink(missing_ok=True)
        return entry

    def entries(self) -> tuple[RunEntry, ...]:
        """Return one entry per finished run in the folder, by file name; other and damaged files
        are left out."""
        found: list[RunEntry] = []
        for path in sorted(self.folder.glob("*.h5")):
            with suppress(RunFileError):
                found.append(read_entry(path))
        return tuple(found)
