"""Where studies are, and the scene that one names."""

from __future__ import annotations

from pathlib import Path

from iapb.errors import ArgumentError
from iapb.scene_files import find_scene, scene_folder
from reports.sweeps.study import Study


def study_names() -> tuple[str, ...]:
    """The studies that come with the project."""
    return tuple(sorted(path.stem for path in (scene_folder() / "sweeps").glob("*.yaml")))


def find_study(name: str) -> Path:
    """Return the study file that `name` means: a path, or the name of a study that comes with the project.

    Raises
    ------
    ArgumentError
        If there is neither; the message lists the studies there are.
    """
    path, ours = Path(name), scene_folder() / "sweeps" / f"{name}.yaml"
    if path.is_file():
        return path
    if Path(name).name == name and ours.is_file():
        return ours
    raise ArgumentError("study", name, f"a file, or one of: {', '.join(study_names())}")


def scene_of(study: Study, path: Path) -> Path:
    """Return the scene file of a study: beside it, or one that comes with the project."""
    beside = path.parent / study.scene
    return beside if beside.is_file() else find_scene(study.scene)
