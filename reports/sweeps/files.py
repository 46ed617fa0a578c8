"""Where studies are, and the scene that one names."""

from __future__ import annotations

from pathlib import Path

from iapb.errors import ArgumentError
from iapb.names import one_of
from iapb.scene import find_scene, scene_folder, scene_names
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
    raise ArgumentError("study", name, one_of(path.stem, study_names(), "a file, or one of: "))


def scene_of(study: Study, path: Path) -> Path:
    """Return the scene file of a study: in its folder or below, or one that comes with the project.

    Parameters
    ----------
    study : as read from its file
    path : of that file

    Raises
    ------
    ArgumentError
        The scene lies elsewhere, or there is none.
    """
    folder = path.resolve().parent
    if study.scene in scene_names():
        beside = folder / study.scene
        return beside if beside.is_file() else find_scene(study.scene)
    given = Path(study.scene)
    if given.is_absolute() or ".." in given.parts or "\0" in study.scene:
        raise ArgumentError("scene", study.scene, "a path inside the study's folder, or the name of a scene of ours")
    found = (folder / given).resolve()
    if not (found.is_relative_to(folder) and found.is_file()):
        expected = one_of(given.stem, scene_names(), "a file beside the study, or one of: ")
        raise ArgumentError("scene", study.scene, expected)
    return found
