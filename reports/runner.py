"""Runs of the paper's worlds through the store: what was computed once is read from its file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from iapb.run import Run
from iapb.scene import Scene
from reports.store import Checkpoint, RunStore

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
        self.used: dict[str, Path] = {}  # label -> file, in the order of use
        self._held: dict[str, Run] = {}

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
            if not (keep and run.complete):
                return run
            self._held[path.name] = run
        self.used[f"{label} {path.stem[-16:]}"] = path
        return self._held[path.name]

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
