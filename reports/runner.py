"""Runs of the paper's worlds through the store: what was computed once is read from its file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from iapb.run import Run
from iapb.scene import Scene
from reports.store import Checkpoint, RunStore
from reports.uses import UsedRun, add_use, read_use, run_command

Progress = Callable[[int, int], None]


class Runner:
    """Simulates a scene in a world, or reads the run that exists.

    Parameters
    ----------
    folder : where run files are, and go.
    progress : called as progress(steps done, steps in all) while a run is computed.
    """

    def __init__(self, folder: Path | str, progress: Progress | None = None) -> None:
        self.store = RunStore(folder)
        self.progress = progress
        self.used: dict[str, UsedRun] = {}  # by file name, in the order of use
        self.user = ""  # who is said to use what is asked for now
        self._held: dict[str, Run] = {}
        self._known: dict[str, UsedRun] = {}

    def __call__(
        self, scene: Scene, world: str, rendering: str = "full", *, keep: bool = True, partial: bool = False
    ) -> Run:
        """Return the run of `scene` in `world`.

        An incomplete run is stored as partial; then what stopped it is raised, or with `partial` the run returned.
        """
        from reference.worlds import require_complete

        inputs, label = self.inputs(scene, world, rendering), self.label(scene, world, rendering)
        path = self.store.path_of(inputs, label)
        if path.name not in self._held:
            run = self.store.get_or_run(inputs, self._computer(scene, world, rendering), label)
            if not partial:
                require_complete(run)
            if not run.complete:
                path = self.store.partial_path_of(inputs, label)
            if not (keep and run.complete):
                self._use(path, scene, world, rendering)
                return run
            self._held[path.name] = run
        self._use(path, scene, world, rendering)
        return self._held[path.name]

    @contextmanager
    def recording(self, user: str) -> Iterator[dict[str, UsedRun]]:
        """Collect the runs used inside, as used by `user`, in a mapping of their own; they count outside as well."""
        outside, user_outside = self.used, self.user
        inside: dict[str, UsedRun] = {}
        self.used, self.user = inside, user
        try:
            yield inside
        finally:
            self.used, self.user = outside, user_outside
            for run in inside.values():
                add_use(outside, run)

    def use_again(self, file: str) -> None:
        """Say that the present user also uses a run that was asked for before."""
        add_use(self.used, replace(self._known[file], used_by=(self.user,) if self.user else ()))

    def file_of(self, scene: Scene, world: str, rendering: str = "full") -> str:
        """Name of the file of a run."""
        return self.store.path_of(self.inputs(scene, world, rendering), self.label(scene, world, rendering)).name

    def _use(self, path: Path, scene: Scene, world: str, rendering: str) -> None:
        if path.name not in self._known:
            command = run_command(scene, world, rendering)
            self._known[path.name] = read_use(path, self.label(scene, world, rendering), command)
        self.use_again(path.name)

    @staticmethod
    def label(scene: Scene, world: str, rendering: str = "full") -> str:
        """Start of the file's name."""
        return "-".join([scene.name, world] + ([rendering] if rendering != "full" else []))

    @staticmethod
    def inputs(scene: Scene, world: str, rendering: str = "full") -> dict[str, Any]:
        """Everything that determines the run, besides the code."""
        from reference.worlds import find_world

        found = find_world(world, rendering)
        coupling = found.coupling_in(scene)
        return {
            "scene": scene.resolved(), "law": found.law.name, "law settings": dict(found.law.settings),
            "coupling": coupling.name, "coupling settings": dict(coupling.settings), "world": world,
        }  # fmt: skip

    def _computer(self, scene: Scene, world: str, rendering: str) -> Callable[[Checkpoint], Run]:
        def compute(checkpoint: Checkpoint) -> Run:
            from reference.worlds import run_world

            return run_world(scene, world, rendering, progress=self.progress, partial=True, checkpoint=checkpoint)

        return compute
