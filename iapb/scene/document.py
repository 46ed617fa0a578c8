"""YAML text to plain values, each with its line and column. Safe: no tags, bounded size, depth and expansion.

Only ruamel's event stream is used, so nothing is ever constructed that is not a number, text, truth value, list
or mapping; scalars follow YAML 1.2 (``1e-3`` is a number, ``yes`` is a text).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 24  # the deepest legal value, a vertex of a shape of a body, lies at depth 7
MAX_NODES = 100_000  # values and field names, aliases expanded: a small file cannot grow without bound
MAX_REPEATED = 100  # repeated fields: more is not a slip, and no list to read
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, Any] = {
    "": None,
    "~": None,
    "null": None,
    "Null": None,
    "NULL": None,
    "true": True,
    "True": True,
    "TRUE": True,
    "false": False,
    "False": False,
    "FALSE": False,
}


@dataclass
class Node:
    """A value of the document and where it stands (line and column count from 1)."""

    value: Any
    line: int
    column: int
    size: int = 1  # values and field names in it, aliases expanded
    children: dict[str | int, Node] = field(default_factory=dict)
    keys: dict[str, tuple[int, int]] = field(default_factory=dict)  # where each key of a mapping stands


class DocumentError(Exception):
    """The text is no document that a scene can be read from; one mistake with its place."""

    def __init__(self, line: int, column: int, value: str, expected: str) -> None:
        self.line, self.column, self.value, self.expected = line, column, value, expected
        super().__init__(expected)


@dataclass(frozen=True)
class Repeated:
    """A key that a mapping has twice."""

    line: int
    column: int
    path: tuple[str | int, ...]


def read_document(text: str) -> tuple[Node, list[Repeated]]:
    """Return the document's root and its repeated keys.

    Raises
    ------
    DocumentError
        where the text is not YAML, or leaves the bounds above.
    """
    if len(text) > MAX_CHARACTERS:
        raise DocumentError(1, 1, f"{len(text)} characters", f"a file of at most {MAX_CHARACTERS} characters")
    builder = _Builder(_events(text))
    return builder.document(), builder.repeated


def _events(text: str) -> Iterator[Any]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        yield from YAML(typ="safe", pure=True).parse(text)
    except MarkedYAMLError as failure:
        mark = failure.problem_mark or failure.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise DocumentError(
            line, column, "(not YAML)", f"valid YAML: {failure.problem or failure}"
        ) from failure
    except YAMLError as failure:  # characters that YAML does not allow: no mark, only text
        raise DocumentError(1, 1, "(not YAML)", f"valid YAML: {' '.join(str(failure).split())}") from failure
    except (ValueError, OverflowError) as failure:  # an escape such as \UFFFFFFFF names no character
        raise DocumentError(1, 1, "(not YAML)", f"valid YAML: {failure}") from failure


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
            kind = type(event).__name__
            if kind in ("StreamStartEvent", "StreamEndEvent", "DocumentStartEvent", "DocumentEndEvent"):
                continue
            if root is not None:
                raise DocumentError(*_place(event), "(second document)", "one document in the file")
            root = self.node(event, ())
        return root if root is not None else Node(None, 1, 1)

    def node(self, event: Any, path: tuple[str | int, ...]) -> Node:
        """Return the node that starts with this event."""
        line, column = _place(event)
        kind = type(event).__name__
        if kind == "AliasEvent":
            node = self.alias(event)
            self.count_in(node.size, line, column)
            return node
        if event.tag is not None and not (kind == "ScalarEvent" and event.tag == "!"):
            raise DocumentError(
                line, column, str(event.tag), "no tags: a scene is plain numbers, texts and lists"
            )
        if len(path) > MAX_DEPTH:
            raise DocumentError(line, column, "(nested too deeply)", f"at most {MAX_DEPTH} levels")
        node = Node(None, line, column)
        self.count_in(1, line, column)
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        if kind == "ScalarEvent":
            node.value = scalar(event.value) if event.style is None and event.tag is None else event.value
        elif kind == "SequenceStartEvent":
            self.sequence(node, path)
        else:
            self.mapping(node, path)
        node.size = 1 + len(node.keys) + sum(child.size for child in node.children.values())
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        return node

    def count_in(self, size: int, line: int, column: int) -> None:
        """Count a value into the bound on the whole document."""
        self.count += size
        if self.count > MAX_NODES:
            raise DocumentError(line, column, f"more than {MAX_NODES} values", "a smaller scene")

    def alias(self, event: Any) -> Node:
        """Return the node that an alias stands for."""
        node = self.anchors.get(event.anchor)
        if node is None:
            known = event.anchor in self.anchors
            raise DocumentError(
                *_place(event),
                f"*{event.anchor}",
                "an alias to a finished value" if known else "an alias whose anchor exists",
            )
        return node

    def sequence(self, node: Node, path: tuple[str | int, ...]) -> None:
        """Read the items of a list up to its end."""
        for event in self.events:
            if type(event).__name__ == "SequenceEndEvent":
                break
            index = len(node.children)
            node.children[index] = self.node(event, (*path, index))
        node.value = [child.value for child in node.children.values()]

    def mapping(self, node: Node, path: tuple[str | int, ...]) -> None:
        """Read the fields of a mapping up to its end."""
        for event in self.events:
            if type(event).__name__ == "MappingEndEvent":
                break
            if type(event).__name__ != "ScalarEvent":
                raise DocumentError(*_place(event), "(not a name)", "the name of a field")
            key, place = event.value, _place(event)
            self.count += 1
            child = self.node(next(self.events), (*path, key))
            if len(self.repeated) == MAX_REPEATED:
                raise DocumentError(*place, f"more than {MAX_REPEATED} repeated fields", "each field once")
            if key in node.children:
                self.repeated.append(Repeated(*place, (*path, key)))
            else:
                node.children[key], node.keys[key] = child, place
        node.value = {key: child.value for key, child in node.children.items()}


def _place(event: Any) -> tuple[int, int]:
    return event.start_mark.line + 1, event.start_mark.column + 1


def scalar(text: str) -> Any:
    """Return the value of an unquoted YAML 1.2 scalar: None, a truth value, a number or the text itself."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.match(text):
        return int(text)
    return float(text) if _FLOAT.match(text) else text
