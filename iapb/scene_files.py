"""Where the scenes that come with the project are: inside an installed package, or in the checkout."""

from __future__ import annotations

from pathlib import Path

from iapb.errors import ArgumentError
from iapb.names import one_of


def scene_folder() -> Path:
    """Return the folder of the scenes that come with the project.

    Returns
    -------
    Path
        inside an installed package, or in the checkout.
    """
    package = Path(__file__).resolve().parent
    installed = package / "scenes"
    return installed if installed.is_dir() else package.parent / "scenes"


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that come with the project, sorted."""
    return tuple(sorted(path.stem for path in scene_folder().glob("*.yaml")))


def find_scene(name: str | Path) -> Path:
    """Return the scene file that `name` means: a path, or the name of a scene that comes with the project.

    Parameters
    ----------
    name : path of a file, or a name such as ``peg_corner``

    Returns
    -------
    Path
        of a file that exists.

    Raises
    ------
    ArgumentError
        If there is neither such a file nor such a scene; the message lists the scenes there are.
    """
    path = Path(name)
    if path.is_file():
        return path
    ours = scene_folder() / f"{path.stem}.yaml"
    if str(name) in (path.stem, path.name) and ours.is_file():
        return ours
    raise ArgumentError("scene", str(name), one_of(path.stem, scene_names(), "a file, or one of: "))
