"""Runs of the paper's worlds through the store: a run is computed once and then read from its
file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial as given
from pathlib import Path
from typing import Any

from iapb.run import Run
from iapb.scene import Scene
from iapb.simulation import require_complete, simulate
from iapb.worlds import find_world
from reference.one_thread import one_thread
from reports.store.folder import Place, RunStore
from reports.store.runs import RunEntry
from reports.store.uses import StoredFile, run_command

Progress = Callable[[int, int], None]


class Runner:
    """Simulates a scene in a world, or reads the existing run.

    Parameters
    ----------
    folder : folder of the run files.
    progress : called as progress(steps done, total steps) while a run is computed.
    """

    def __init__(self, folder: Path | str, progress: Progress | None = None) -> None:
        self.store = RunStore(folder)
        self.progress = progress
        self.used: dict[str, StoredFile] = {}  # by file name, in the order of use
        # of all runs used so far, inside and outside of an open `recording`
        self.files: set[str] = set()
        self.user = ""  # the user recorded for the runs requested now
        self._held: dict[str, tuple[Run, RunEntry]] = {}
        self._known: dict[str, StoredFile] = {}
        self._places: dict[tuple[int, str, str, int], tuple[Place, Scene]] = {}

    def __call__(
        self,
        scene: Scene,
        world: str,
        rendering: str = "full",
        *,
        keep: bool = True,
        partial: bool = False,
    ) -> Run:
        """Return the run of `scene` in `world`.

        An incomplete run is stored as partial. Then the error that stopped it is raised; with
        `partial` the run is returned instead.
        """
        place = self.place_of(scene, world, rendering)
        name = place.path.name
        run, entry = self._held.get(name) or self.fetch(scene, world, rendering)
        if keep and run.complete:
            self._held[name] = run, entry
        if not partial:
            require_complete(run)
        self._know(entry, scene, world, rendering)
        self.use_again(scene, world, rendering)
        return run

    def fetch(
        self, scene: Scene, world: str, rendering: str = "full", every: int = 1
    ) -> tuple[Run, RunEntry]:
        """Read or compute a run, which may be partial; return it with the entry of its file.

        every : keep every N-th step (see `iapb.simulation.simulate`).
        """
        found = find_world(world, rendering)
        compute = given(
            one_thread()(simulate),
            scene,
            found.law,
            found.coupling_in(scene),
            world=world if rendering == "full" else f"{world} {rendering}",
            every=every,
            progress=self.progress,
        )
        return self.store.fetch(self.place_of(scene, world, rendering, every), compute)

    @contextmanager
    def recording(self, user: str) -> Iterator[dict[str, StoredFile]]:
        """Yield a mapping that collects the runs used inside this context as used by `user`.

        The runs also count as used outside of it.
        """
        outside = self.used
        user_outside = self.user
        inside: dict[str, StoredFile] = {}
        self.used = inside
        self.user = user
        try:
            yield inside
        finally:
            self.used = outside
            self.user = user_outside
            for run in inside.values():
                self.use(run)

    def use(self, run: StoredFile) -> None:
        """Record a run as used; its earlier users are kept."""
        before = self.used[run.file].used_by if run.file in self.used else ()
        self.used[run.file] = replace(run, used_by=tuple(dict.fromkeys(before + run.used_by)))
        self.files.add(run.file)

    def use_again(self, scene: Scene, world: str, rendering: str = "full") -> None:
        """Record that the current user also uses a run, if it was requested before."""
        if known := self._known.get(self.file_of(scene, world, rendering)):
            self.use(replace(known, used_by=(self.user,) if self.user else ()))

    def file_of(self, scene: Scene, world: str, rendering: str = "full") -> str:
        """Return the name of the file of a run."""
        return self.place_of(scene, world, rendering).path.name

    def place_of(self, scene: Scene, world: str, rendering: str = "full", every: int = 1) -> Place:
        """Return the place of a run."""
        asked = id(scene), world, rendering, every
        if (
            asked not in self._places
        ):  # a key costs a millisecond; the scene is held, so that its id stays its own
            found = find_world(world, rendering)
            inputs = run_inputs(scene, found.law, found.coupling_in(scene), world, every)
            self._places[asked] = (
                self.store.place_of(inputs, self.label(scene, world, rendering)),
                scene,
            )
        return self._places[asked][0]

    def _know(self, entry: RunEntry, scene: Scene, world: str, rendering: str) -> None:
        name = self.file_of(scene, world, rendering)
        if (
            name not in self._known or self._known[name].file != entry.file
        ):  # a partial run has another file
            command = (
                run_command(scene, world, rendering) or f"iapb store again out/runs/{entry.file}"
            )
            self._known[name] = StoredFile(entry.file, entry.content_hash, command)

    @staticmethod
    def label(scene: Scene, world: str, rendering: str = "full") -> str:
        """Return the start of the file's name."""
        return "-".join([scene.name, world] + ([rendering] if rendering != "full" else []))


def run_inputs(scene: Scene, law: Any, coupling: Any, world: str, every: int = 1) -> dict[str, Any]:
    """Return everything that determines a run, besides the code."""
    return {
        "scene": scene.resolved(),
        "law": law.name,
        "law settings": dict(law.settings),
        "coupling": coupling.name,
        "coupling settings": dict(coupling.settings),
        "world": world,
        "every": every,
    }
