"""RunStore: a folder of runs, one HDF5 file each, in which nothing is computed twice.

    store = RunStore("out/runs")
    run = store.get_or_run(inputs, lambda checkpoint: simulate(scene, law))

A file is named by a label and its run key, the hash of everything that determines the run. While a run is under
way its last checkpoint is ``<name>.h5.partial``: a whole file, replaced in one step, so that it can be read at any
moment, also after the process was killed. A finished file is never written again.

Writing whole checkpoints, rather than flushing a growing file, is what makes "readable" certain; that it costs a
fixed share of the time at most is the checkpoint's own business (see `Checkpoint`).
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from iapb.errors import ArgumentError, RunFileError
from iapb.run import Run
from reports.store_files import remove_abandoned
from reports.store_index import RunEntry, add_to_index, read_index
from reports.store_keys import run_key
from reports.store_read import read_head, read_run
from reports.store_write import write_run

__all__ = ["Checkpoint", "RunEntry", "RunStore", "read_run", "run_key", "write_run"]

PARTIAL_SUFFIX = ".partial"
_KEY_DIGITS = 16  # 64 bits in the name: a chance hit among a million runs is below 1e-7; the file holds all 256
# Between two checkpoints pass at least this long, and this many times what the last one took.
_SHORTEST_PAUSE_SECONDS = 5.0
_PAUSE_PER_WRITE = 20.0


@dataclass
class Checkpoint:
    """Saves an unfinished run now and then: call it as often as you like with the run so far.

    ``checkpoint.due`` says whether the next call would write, for callers to whom making a Run costs something.
    ``checkpoint(run, force=True)`` writes at once (before giving up, say).
    """

    path: Path
    key: str = ""
    pause: float = _SHORTEST_PAUSE_SECONDS  # [s]
    _next: float = field(default=0.0, init=False, repr=False)

    def __post_init__(self) -> None:
        self._next = time.monotonic() + self.pause

    @property
    def due(self) -> bool:
        """Whether enough time has passed since the last checkpoint."""
        return time.monotonic() >= self._next

    def __call__(self, run: Run, *, force: bool = False) -> bool:
        """Save `run` if a checkpoint is due; return whether it was saved."""
        if not (force or self.due):
            return False
        start = time.monotonic()
        write_run(self.path, run, key=self.key, replace=True)
        end = time.monotonic()
        self._next = end + max(self.pause, _PAUSE_PER_WRITE * (end - start))
        return True


class RunStore:
    """A folder of runs.

    Parameters
    ----------
    folder
        Made if it does not exist.
    code
        Code version that enters the run keys; by default a hash of the engine's and the references' sources.
        Runs of a law of your own: add its version here, or in the inputs.
    """

    def __init__(self, folder: Path | str, code: str | None = None) -> None:
        self.folder = Path(folder)
        self.code = code
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunFileError(f"{self.folder}: cannot be a folder of runs: {error.strerror or error}") from error
        remove_abandoned(self.folder)

    def key(self, inputs: Mapping[str, Any]) -> str:
        """Return the run key of `inputs`."""
        return run_key(inputs, self.code)

    def path_of(self, inputs: Mapping[str, Any], label: str = "run") -> Path:
        """Return the file that the run of `inputs` has, or will have.

        `label` starts the name, for people; it is no part of the key, and a run is found under any label.
        """
        key = self.key(inputs)
        found = sorted(self.folder.glob(f"*-{key[:_KEY_DIGITS]}.h5"))
        return found[0] if found else self.folder / f"{_file_name(label)}-{key[:_KEY_DIGITS]}.h5"

    def partial_path_of(self, inputs: Mapping[str, Any], label: str = "run") -> Path:
        """Return the file that holds the last checkpoint of an unfinished run of `inputs`."""
        path = self.path_of(inputs, label)
        return path.with_name(path.name + PARTIAL_SUFFIX)

    def __contains__(self, inputs: Mapping[str, Any]) -> bool:
        return self.path_of(inputs).is_file()

    def get(self, inputs: Mapping[str, Any]) -> Run | None:
        """Return the finished run of `inputs`, or None if there is none yet.

        Raises
        ------
        RunFileError
            If its file is damaged. It is never replaced in silence: remove it to have the run computed again.
        """
        path = self.path_of(inputs)
        if not path.is_file():
            return None
        stored = read_head(path)["run_key"]
        if stored != self.key(inputs):
            raise RunFileError(f"{path}: run key is {stored}: expected {self.key(inputs)}")
        return read_run(path)

    def get_or_run(
        self, inputs: Mapping[str, Any], compute: Callable[[Checkpoint], Run], label: str = "run"
    ) -> Run:
        """Return the run of `inputs`: from its file if there is one, else computed and stored.

        Parameters
        ----------
        inputs
            Everything that determines the run, as mappings, sequences, arrays, numbers and texts.
        compute
            Makes the run. It may call the `Checkpoint` it is given with the run so far.
        label
            Start of the file's name.

        Returns
        -------
        Run
            With ``complete=False`` where `compute` gave up early: stored as partial, computed again next time.
        """
        stored = self.get(inputs)
        if stored is not None:
            return stored
        checkpoint = Checkpoint(self.partial_path_of(inputs, label), self.key(inputs))
        run = compute(checkpoint)
        if not isinstance(run, Run):
            raise ArgumentError("compute", run, "a function that returns a Run")
        if not run.complete:
            checkpoint(run, force=True)
            return run
        self.put(inputs, run, label)
        return run

    def put(self, inputs: Mapping[str, Any], run: Run, label: str = "run") -> Path:
        """Store a finished run, and return its file; a file that is already there stays as it is."""
        if not run.complete:
            raise ArgumentError("run.complete", run.complete, "True: unfinished runs are kept by Checkpoint")
        path = self.path_of(inputs, label)
        write_run(path, run, key=self.key(inputs))
        self.partial_path_of(inputs, label).unlink(missing_ok=True)
        add_to_index(self.folder, path)
        return path

    def entries(self) -> tuple[RunEntry, ...]:
        """Return the index: one entry per finished run in the folder, by file name."""
        return read_index(self.folder)

    def partial_runs(self) -> tuple[Path, ...]:
        """Return the files of unfinished runs."""
        return tuple(sorted(self.folder.glob(f"*.h5{PARTIAL_SUFFIX}")))


def _file_name(label: str) -> str:
    return re.sub(r"[^A-Za-z0-9._]+", "-", label).strip("-.") or "run"
