"""The runs behind the paper's figures, by the input names that the figures use."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from iapb import find_scene, load_scene
from iapb.run import Run
from iapb.scene import Scene
from reports.runner import Runner
from verification.claims.conditions import IGNORED, TILTS, Condition
from verification.finding import Failure, attempt, counted

# Emulation of the experiments in the paper's section VII: the device runs at 512 Hz with a delay of
# one step in each direction, encoders of 1 µm and 0.01 mrad, and low bearing friction. These
# numbers are ours: the paper gives none.
EMULATED_DEVICE: dict[str, Any] = {
    "device.delay": 1,
    "device.position_resolution": [1e-6, 1e-6, 1e-5],
    "device.damping": [0.5, 0.5, 1e-3],
}

# name of the input -> (scene, values changed, world, rendering)
FIGURE_RUNS: dict[str, tuple[str, dict[str, Any], str, str]] = {
    "corner/ideal": ("peg_corner", {}, "ideal", "full"),
    "corner/IAPB": ("peg_corner", {}, "IAPB", "full"),
    "corner/PB": ("peg_corner", {}, "PB", "full"),
    "corner/CBuc": ("peg_corner", {}, "CBuc", "full"),
    "corner/IAPB-saturate": ("peg_corner", {}, "IAPB", "saturate"),
    "corner/IAPB-scale": ("peg_corner", {}, "IAPB", "scale"),
    "corner/IAPB-spread": ("peg_corner", {}, "IAPB", "spread"),
    "device/IAPB": ("peg_corner", EMULATED_DEVICE, "IAPB", "full"),
    "device/IAPB-LM": ("peg_corner", EMULATED_DEVICE, "IAPB", "spread"),
    "device/PB": ("peg_corner", EMULATED_DEVICE, "PB", "full"),
}

# names of the inputs made by `tilted_runs` and `corner_scene`
TILTED = "peg at every tilt"
CORNER_SCENE = "scene/peg_corner"


def shipped_scene(name: str, values: dict[str, Any] | None = None) -> Scene:
    """Return a scene that comes with the project, with some values changed."""
    scene = load_scene(find_scene(name))
    return scene.with_values(values) if values else scene


def figure_runs(
    runner: Runner, progress: Callable[[int, int], None], failures: list[Failure] | None = None
) -> dict[str, Run]:
    """Return every run in FIGURE_RUNS, computed or read; runs that fail are left out."""
    runs = {}
    for name in counted(FIGURE_RUNS, progress):
        with runner.recording(name):
            run = attempt(name, partial(figure_run, runner, name), failures)
        if run is not None:
            runs[name] = run
    return runs


def figure_run(runner: Runner, name: str, changed: dict[str, Any] | None = None) -> Run:
    """Return the run in FIGURE_RUNS with this name, computed or read; `changed` are more values."""
    scene, values, world, rendering = FIGURE_RUNS[name]
    return runner(shipped_scene(scene, values | (changed or {})), world, rendering)


def tilted_runs(
    runner: Runner, changed: dict[str, Any] | None = None
) -> dict[float, dict[str, Run]]:
    """Return the runs of the peg in the corner by tilt [rad] and world; claim C10 uses the same
    runs."""
    scene = shipped_scene("peg_corner", changed)
    with runner.recording(TILTED):
        return {
            tilt: {world: runner(Condition(tilt).place(scene), world) for world in IGNORED}
            for tilt in TILTS["full"]
        }


def corner_scene() -> dict[str, Any]:
    """Return the resolved scene of the peg in the corner."""
    return shipped_scene("peg_corner").resolved()
