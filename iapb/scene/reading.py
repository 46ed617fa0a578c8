"""Find and read scene files; report every mistake with file, line, column, field path and expected value."""

from __future__ import annotations

from os import fspath
from os.path import exists, isfile
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from iapb.errors import ArgumentError, Mistake, SceneError, shown
from iapb.names import nearest, one_of
from iapb.scene.document import MAX_CHARACTERS, Document
from iapb.scene.model import Scene, scene_kind
from iapb.scene.parts import mistakes_of
from iapb.scene.robots import with_robots


def scene_folder() -> Path:
    """Return the folder of the scenes that come with the project.

    Returns
    -------
    Path
        in the installed package, or in the checkout.
    """
    package = Path(__file__).resolve().parents[1]
    installed = package / "scenes"
    return installed if installed.is_dir() else package.parent / "scenes"


def scene_names() -> tuple[str, ...]:
    """Return the names of the scenes that come with the project, sorted."""
    return tuple(sorted(path.stem for path in scene_folder().glob("*.yaml")))


def find_scene(name: str | Path) -> Path:
    """Return the scene file for `name`, which is a path or the name of a scene of the project.

    Parameters
    ----------
    name : path of a file, or a name such as ``peg_corner``

    Returns
    -------
    Path
        path of an existing file.

    Raises
    ------
    ArgumentError
        There is neither such a file nor such a scene; the message lists the scenes of the project.
    """
    try:
        path = Path(name)
    except TypeError:
        raise ArgumentError("scene", name, "a path, or the name of a scene") from None
    if isfile(path):  # a path that is too long is no file; Path.is_file raises OSError
        return path
    ours = scene_folder() / f"{path.stem}.yaml"
    if str(name) in (path.stem, path.name) and isfile(ours):
        return ours
    said, near = one_of(path.stem, scene_names(), "a file, or one of: "), ""
    if path.suffix:  # a file was meant
        near = nearest(path.name, (file.name for file in path.parent.glob(f"*{path.suffix}")))
    raise ArgumentError("scene", str(name), f"{said.partition('; did')[0]}; did you mean {path.parent / near}?" if near
                        else said)


def load_scene(path: str | Path) -> Scene:
    """Read a scene from a YAML file.

    Parameters
    ----------
    path : path of the file; its URDF files must be in the same folder or below

    Returns
    -------
    Scene
        checked, with all defaults filled in.

    Raises
    ------
    ArgumentError
        the file cannot be opened.
    SceneError
        the file is not a valid scene; the error lists all mistakes.
    """
    try:
        if exists(path := fspath(path)) and not isfile(path):  # a number would be an open file
            raise ValueError("no regular file")  # a pipe would be waited for
        with open(path, "rb") as file:
            content = file.read(4 * MAX_CHARACTERS + 1)
    except (OSError, TypeError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or failure
        raise ArgumentError("path", str(path), f"a readable scene file ({reason})") from failure
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = content.count(b"\n", 0, failure.start) + 1
        wrong = shown(content[failure.start : failure.end])
        raise SceneError([Mistake(str(path), line, 1, "(file)", wrong, "text in UTF-8")]) from failure
    return scene_from_text(text, str(path))


def scene_from_text(text: str, file: str = "(text)") -> Scene:
    """Read a scene from YAML text; `file` is the file name in the messages of mistakes.

    Raises
    ------
    SceneError
        the text is not a valid scene; the error lists all mistakes.
    """
    document = Document(text, file)
    given, mistakes = with_robots(document)
    try:
        scene = scene_kind(given).model_validate(given)
    except ValidationError as failure:
        mistakes += mistakes_of(failure, document.file, document.value, document.place)
    mistakes += document.mistakes
    if mistakes:
        raise SceneError(sorted(mistakes, key=lambda mistake: (mistake.line, mistake.column)))
    if given is document.value:
        scene._source_text, scene._file = text, file if file != "(text)" else ""
    else:
        scene._about = f"{scene.name} with its robots as bodies"
    return scene


def scene_from_values(given: Any) -> Scene:
    """Return the scene with these plain values, all of them, as a run records them.

    Raises
    ------
    ArgumentError
        They are no scene; the error names the first mistake.
    """
    try:
        scene: Scene = scene_kind(given).model_validate(given)
    except ValidationError as failure:
        wrong = failure.errors()[0]
        raise ArgumentError("scene " + ".".join(map(str, wrong["loc"])), wrong["input"], wrong["msg"]) from None
    return scene
