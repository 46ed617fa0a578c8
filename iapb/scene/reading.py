"""Find and read scene files; report every mistake with file, line, column, field path and expected
value."""

from __future__ import annotations

from os.path import isfile
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from iapb.errors import ArgumentError, Mistake, SceneError, shown
from iapb.names import bytes_of, nearest, one_of
from iapb.scene.document import MAX_CHARACTERS, Document
from iapb.scene.mechanism import joint_fault
from iapb.scene.model import Scene, scene_kind
from iapb.scene.parts import ScenePart, mistakes_of, written
from iapb.scene.robots import told, with_robots

Part = TypeVar("Part", bound=ScenePart)
_YAML = "a scene file in YAML (docs/scenes.md)"
# endings of models that other programs read
MODELS = {
    ".xml": f"{_YAML}; models of MuJoCo are not read: give bodies and walls, or a robot as URDF",
    ".urdf": f"{_YAML}, which takes this robot by: robots: [{{name: robot, urdf: FILE}}]",
}


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


def scene_names(folder: str = "") -> tuple[str, ...]:
    """Return the names of the scenes that come with the project, sorted; with a folder, of the
    files in it."""
    return tuple(sorted(path.stem for path in (scene_folder() / folder).glob("*.yaml")))


def find_scene(name: str | Path, folder: str = "") -> Path:
    """Return the scene file for `name`, which is a path or the name of a scene of the project.

    Parameters
    ----------
    name : path of a file, or a name such as ``peg_corner``
    folder : of the project's scenes, such as ``sweeps``

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
        if path.suffix.lower() in MODELS:
            raise ArgumentError("scene", str(name), MODELS[path.suffix.lower()])
        return path
    ours = scene_folder() / folder / f"{path.stem}.yaml"
    if str(name) in (path.stem, path.name) and isfile(ours):
        return ours
    said = one_of(path.stem, scene_names(folder), "a file, or one of: ")
    if path.suffix:  # a file was meant
        near = nearest(path.name, (file.name for file in path.parent.glob(f"*{path.suffix}")))
        if near:
            said = f"{said.partition('; did')[0]}; did you mean {path.parent / near}?"
    raise ArgumentError("scene", str(name), said)


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
    return scene_from_text(read_text(path), str(path))


def read_text(path: str | Path) -> str:
    """Return the text of a scene file or a study; it raises the errors of `load_scene`."""
    content = bytes_of(path, 4 * MAX_CHARACTERS + 1, "a readable scene file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = content.count(b"\n", 0, failure.start) + 1
        wrong = shown(content[failure.start : failure.end])
        mistake = Mistake(str(path), line, 1, "(file)", wrong, "text in UTF-8")
        raise SceneError([mistake]) from failure


def scene_from_text(text: str, file: str = "(text)") -> Scene:
    """Read a scene from YAML text; `file` is the file name in the messages of mistakes.

    Raises
    ------
    SceneError
        the text is not a valid scene; the error lists all mistakes.
    """
    document = Document(text, file)
    given, added = with_robots(document)
    try:
        scene = checked(scene_kind(given), given, document, added.mistakes)
        if fault := joint_fault(scene):
            path = ("bodies", fault.body, fault.field)
            body = scene.bodies[fault.body].name
            name = written(path) if added.origins else f"{fault.field} of {body}"
            place = document.place(path)
            raise SceneError([Mistake(file, *place, name, str(fault.value), fault.expected)])
    except SceneError as failure:
        raise SceneError(told(failure.mistakes, added, document)) from None
    if given is document.value:
        scene._source_text = text
        scene._file = file if file != "(text)" else ""
    else:
        scene._about = f"{scene.name} with its robots as bodies"
        scene._remarks = tuple(added.remarks)
    return scene


def checked(
    kind: type[Part], given: Any, document: Document, mistakes: list[Mistake], what: str = "scene"
) -> Part:
    """Return the values `given` of a document as a part.

    Raises
    ------
    SceneError
        the values are wrong, or there are `mistakes` already; `what` names the kind of file.
    """
    try:
        part = kind.model_validate(given)
    except ValidationError as failure:
        mistakes = mistakes + mistakes_of(failure, document.file, given, document.place)
    mistakes = mistakes + document.mistakes
    if mistakes:
        raise SceneError(sorted(mistakes, key=lambda mistake: (mistake.line, mistake.column)), what)
    return part


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
        raise ArgumentError(
            "scene " + ".".join(map(str, wrong["loc"])), wrong["input"], wrong["msg"]
        ) from None
    return scene
