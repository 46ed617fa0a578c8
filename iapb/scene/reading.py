"""Find and read scene files; report every mistake, each with file, line, column, field path and expectation."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from iapb.errors import ArgumentError, Mistake, SceneError, shown
from iapb.names import nearest, one_of
from iapb.scene.model import Scene, scene_kind, scene_text
from iapb.scene.parts import mistakes_of, written
from iapb.scene.robots import with_robots


def scene_folder() -> Path:
    """Return the folder of the scenes that come with the project.

    Returns
    -------
    Path
        inside an installed package, or in the checkout.
    """
    package = Path(__file__).resolve().parents[1]
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
    said, near = one_of(path.stem, scene_names(), "a file, or one of: "), ""
    if path.suffix:  # a file was meant
        near = nearest(path.name, (file.name for file in path.parent.glob(f"*{path.suffix}")))
    raise ArgumentError("scene", str(name), f"{said.partition('; did')[0]}; did you mean {path.parent / near}?" if near
                        else said)


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
        wrong = shown(content[failure.start : failure.end])
        raise SceneError([Mistake(str(path), line, 1, "(file)", wrong, "text in UTF-8")]) from failure
    return scene_from_text(text, str(path))


def scene_from_text(text: str, file: str = "(text)") -> Scene:
    """Read a scene from YAML text; `file` is the name that mistakes are reported under.

    Raises
    ------
    SceneError
        the text is not a scene; carries all of its mistakes.
    """
    root, mistakes = read_values(text, file)
    given, wrong = with_robots(root.value, file, root.stands_at)
    try:
        scene = scene_kind(given).model_validate(given)
    except ValidationError as failure:
        mistakes += mistakes_of(failure, file, root.value, root.stands_at)
    mistakes += wrong
    if mistakes:
        raise SceneError(sorted(mistakes, key=lambda mistake: (mistake.line, mistake.column)))
    scene._file = file if given is root.value else ""
    scene._source_text = text if given is root.value else scene_text(scene, f"{scene.name} with its robots as bodies")
    return scene


def read_values(text: str, file: str, what: str = "scene") -> tuple[Node, list[Mistake]]:
    """Return the values of a YAML text with their places, and its repeated fields as mistakes.

    Raises
    ------
    SceneError
        the text is no document of plain values; `what` it should be, in words.
    """
    try:
        root, repeated = read_document(text)
    except DocumentError as failure:
        mistake = Mistake(file, *failure.place, "(file)", failure.value, failure.expected)
        raise SceneError([mistake], what) from failure
    return root, [Mistake(file, *r.place, written(r.path), "(repeated)", "each field once") for r in repeated]


# YAML text to plain values, each with its line and column. Safe: no tags, bounded size, depth and expansion.
#
# Only ruamel's event stream is used, so nothing is ever constructed that is not a number, text, truth value, list
# or mapping; scalars follow YAML 1.2 (``1e-3`` is a number, ``yes`` is a text).


MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 24  # the deepest legal value, a vertex of a shape of a body, lies at depth 7
MAX_NODES = 100_000  # values and field names, aliases expanded: a small file cannot grow without bound
MAX_REPEATED = 100  # repeated fields: more is not a slip, and no list to read
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
Place = tuple[int, int]  # line and column, from 1


@dataclass
class Node:
    """A value of the document and where it stands (line and column count from 1)."""

    value: Any
    place: Place
    size: int = 1  # values and field names in it, aliases expanded
    children: dict[str | int, Node] = field(default_factory=dict)
    keys: dict[str, Place] = field(default_factory=dict)  # where each key of a mapping stands

    def stands_at(self, path: tuple[str | int, ...], key: bool = False) -> Place:
        """Return the place of a value below (or of its key); of the nearest part around it where it is absent."""
        node = self
        for step in path:
            if key and step == path[-1] and step in node.keys:
                return node.keys[str(step)]
            if step not in node.children:
                break
            node = node.children[step]
        return node.place


class DocumentError(Exception):
    """The text is no document that a scene can be read from; one mistake with its place."""

    def __init__(self, place: Place, value: str, expected: str) -> None:
        self.place, self.value, self.expected = place, value, expected
        super().__init__(expected)


@dataclass(frozen=True)
class Repeated:
    """A key that a mapping has twice."""

    place: Place
    path: tuple[str | int, ...]


def read_document(text: str) -> tuple[Node, list[Repeated]]:
    """Return the document's root and its repeated keys.

    Raises
    ------
    DocumentError
        where the text is not YAML, or leaves the bounds above.
    """
    if len(text) > MAX_CHARACTERS:
        raise DocumentError((1, 1), f"{len(text)} characters", f"a file of at most {MAX_CHARACTERS} characters")
    builder = _Builder(_events(text))
    return builder.document(), builder.repeated


def _events(text: str) -> Iterator[Any]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except MarkedYAMLError as failure:
        mark = failure.problem_mark or failure.context_mark
        place = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise DocumentError(place, "(not YAML)", f"valid YAML: {failure.problem or failure}") from failure
    except (YAMLError, ValueError, OverflowError) as failure:  # a character that YAML has not: no mark, only text
        raise DocumentError((1, 1), "(not YAML)", f"valid YAML: {' '.join(str(failure).split())}") from failure


class _Builder:
    """Builds nodes from events; one event is taken at a time, so that a bound stops the reader early."""

    def __init__(self, events: Iterator[Any]) -> None:
        self.events = events
        self.anchors: dict[str, Node | None] = {}  # None: not finished yet
        self.repeated: list[Repeated] = []
        self.count = 0

    def document(self) -> Node:
        """Return the root of the only document of the stream."""
        root: Node | None = None
        for event in self.events:
            if _kind(event) in ("StreamStart", "StreamEnd", "DocumentStart", "DocumentEnd"):
                continue
            if root is not None:
                raise DocumentError(_place(event), "(second document)", "one document in the file")
            root = self.node(event, ())
        return root if root is not None else Node(None, (1, 1))

    def node(self, event: Any, path: tuple[str | int, ...]) -> Node:
        """Return the node that starts with this event."""
        kind, place = _kind(event), _place(event)
        node = self.alias(event) if kind == "Alias" else Node(None, place)
        self.count += node.size
        if self.count > MAX_NODES:
            raise DocumentError(place, f"more than {MAX_NODES} values", "a smaller scene")
        if kind == "Alias":
            return node
        if event.tag is not None and not (kind == "Scalar" and event.tag == "!"):
            raise DocumentError(place, str(event.tag), "no tags: a scene is plain numbers, texts and lists")
        if len(path) > MAX_DEPTH:
            raise DocumentError(place, "(nested too deeply)", f"at most {MAX_DEPTH} levels")
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        if kind == "Scalar":
            node.value = scalar(event.value) if event.style is None and event.tag is None else event.value
        elif kind == "SequenceStart":
            self.sequence(node, path)
        else:
            self.mapping(node, path)
        node.size = 1 + len(node.keys) + sum(child.size for child in node.children.values())
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        return node

    def alias(self, event: Any) -> Node:
        """Return the node that an alias stands for."""
        node = self.anchors.get(event.anchor)
        if node is None:
            known = event.anchor in self.anchors
            expected = "an alias to a finished value" if known else "an alias whose anchor exists"
            raise DocumentError(_place(event), f"*{event.anchor}", expected)
        return node

    def sequence(self, node: Node, path: tuple[str | int, ...]) -> None:
        """Read the items of a list up to its end."""
        for index, event in enumerate(self.events):
            if _kind(event) == "SequenceEnd":
                break
            node.children[index] = self.node(event, (*path, index))
        node.value = [child.value for child in node.children.values()]

    def mapping(self, node: Node, path: tuple[str | int, ...]) -> None:
        """Read the fields of a mapping up to its end."""
        for event in self.events:
            if _kind(event) == "MappingEnd":
                break
            if _kind(event) != "Scalar":
                raise DocumentError(_place(event), "(not a name)", "the name of a field")
            key, place = event.value, _place(event)
            self.count += 1
            child = self.node(next(self.events), (*path, key))
            if len(self.repeated) == MAX_REPEATED:
                raise DocumentError(place, f"more than {MAX_REPEATED} repeated fields", "each field once")
            if key in node.children:
                self.repeated.append(Repeated(place, (*path, key)))
            else:
                node.children[key], node.keys[key] = child, place
        node.value = {key: child.value for key, child in node.children.items()}


def _kind(event: Any) -> str:
    return type(event).__name__.removesuffix("Event")


def _place(event: Any) -> Place:
    return event.start_mark.line + 1, event.start_mark.column + 1


def scalar(text: str) -> Any:
    """Return the value of an unquoted YAML 1.2 scalar: None, a truth value, a number or the text itself."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.match(text):
        return int(text)
    return float(text) if _FLOAT.match(text) else text
