"""Read a scene file; report every mistake in it, each with file, line, column, field path and expectation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from iapb.errors import ArgumentError, Mistake, SceneError, shown
from iapb.scene.document import MAX_CHARACTERS, DocumentError, Node, read_document
from iapb.scene.model import Scene
from iapb.scene.parts import MISSING
from iapb.scene.robots import with_robots
from iapb.scene.space import scene_kind
from iapb.scene.writing import scene_text

Place = tuple[str | int, ...]


def load_scene(path: str | Path) -> Scene:
    """Read a scene from a YAML file.

    Parameters
    ----------
    path : of the file; the URDF files that it names lie in its folder or below

    Returns
    -------
    Scene
        checked whole, every default filled in.

    Raises
    ------
    ArgumentError
        the file cannot be opened.
    SceneError
        the file is not a scene; carries all of its mistakes.
    """
    try:
        with open(path, "rb") as file:
            content = file.read(4 * MAX_CHARACTERS + 1)
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or failure
        raise ArgumentError("path", str(path), f"a readable scene file ({reason})") from failure
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = content.count(b"\n", 0, failure.start) + 1
        raise SceneError(
            [
                Mistake(
                    str(path), line, 1, "(file)", shown(content[failure.start : failure.end]), "text in UTF-8"
                )
            ]
        ) from failure
    return scene_from_text(text, str(path))


def scene_from_text(text: str, file: str = "(text)") -> Scene:
    """Read a scene from YAML text; `file` is the name that mistakes are reported under.

    Raises
    ------
    SceneError
        the text is not a scene; carries all of its mistakes.
    """
    try:
        root, repeated = read_document(text)
    except DocumentError as failure:
        raise SceneError(
            [Mistake(file, failure.line, failure.column, "(file)", failure.value, failure.expected)]
        ) from failure
    mistakes = [
        Mistake(file, r.line, r.column, written(r.path), "(repeated)", "each field once") for r in repeated
    ]
    given, wrong = with_robots(root.value, file, lambda path: _stands_at(root, path, key=False))
    try:
        scene = scene_kind(given).model_validate(given)
    except ValidationError as failure:
        mistakes += mistakes_of(failure, file, root)
    mistakes += wrong
    if mistakes:
        raise SceneError(sorted(mistakes, key=lambda mistake: (mistake.line, mistake.column)))
    scene._source_text = text if given is root.value else scene_text(scene, f"{scene.name} with its robots as bodies")
    return scene


def mistakes_of(
    failure: ValidationError, file: str, root: Node | None = None, values: Any = None
) -> list[Mistake]:
    """Return pydantic's errors as mistakes, placed by the document's nodes (line 0 where there is no document)."""
    read = root.value if root is not None else values
    return [_mistake(error, file, read, root) for error in failure.errors(include_url=False)]


def _mistake(error: Any, file: str, read: Any, root: Node | None) -> Mistake:
    path, exists = _field_path(error["loc"], read)
    missing = error["type"] == MISSING
    value = "(missing)" if missing else shown(error["input"]) + ("" if exists else " (default)")
    line, column = (
        _stands_at(root, path, key=error["msg"].startswith("one of the known fields")) if root else (0, 0)
    )
    return Mistake(file, line, column, written(path), value, error["msg"])


def _field_path(where: Place, read: Any) -> tuple[Place, bool]:
    """Return the path in the file, without the shape kinds that pydantic puts in, and whether it exists there."""
    path: list[str | int] = []
    exists = True
    for key in where:
        if isinstance(read, dict) and key not in read and key == read.get("kind"):
            continue
        path.append(key)
        try:
            read = read[key]
        except (KeyError, IndexError, TypeError):
            read, exists = None, False
    return tuple(path), exists


def _stands_at(root: Node, path: Place, key: bool) -> tuple[int, int]:
    """Return line and column of a value (or of its key); of the nearest part around it where it is absent."""
    node, place = root, (root.line, root.column)
    for step in path:
        if key and step == path[-1] and step in node.keys:
            return node.keys[step]
        if step not in node.children:
            break
        node = node.children[step]
        place = (node.line, node.column)
    return place


def written(path: Place) -> str:
    """Return a path as it is written in messages, such as ``bodies[0].mass``."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else step
    return text or "(file)"
