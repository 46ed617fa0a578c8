"""Convert YAML text to plain values with line and column, and back. Tags are refused; size and depth are bounded.

Only ruamel's event stream is used, so the reader makes only numbers, texts, truth values, lists and mappings. Scalars
follow YAML 1.2 (``1e-3`` is a number, ``yes`` is a text).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 24  # the deepest valid value, a vertex of a body's shape, has depth 7
MAX_NODES = 100_000  # values and field names after expansion of aliases, which could make a small file huge
MAX_REPEATED = 100  # largest number of repeated fields to report
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_PLAIN = re.compile(r"[A-Za-z_][\w ./()*+-]*(?<! )", re.ASCII)  # a text that needs no quotes in YAML
_OTHERWISE = ("null", "true", "false", "yes", "no", "on", "off", "y", "n")  # these need quotes all the same
Place = tuple[int, int]  # line and column, from 1


@dataclass
class Node:
    """A value of the document and its place (line and column count from 1)."""

    value: Any
    place: Place
    size: int = 1  # number of values and field names in it, after expansion of aliases
    children: dict[str | int, Node] = field(default_factory=dict)
    keys: dict[str, Place] = field(default_factory=dict)  # place of each key of a mapping

    def stands_at(self, path: tuple[str | int, ...], key: bool = False) -> Place:
        """Return the place of a nested value or of its key; if it is absent, of the nearest value around it."""
        node = self
        for step in path:
            if key and step == path[-1] and step in node.keys:
                return node.keys[str(step)]
            if step not in node.children:
                break
            node = node.children[step]
        return node.place


class DocumentError(Exception):
    """The text is not a document of plain values; the error has one mistake with its place."""

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
        The text is not YAML, or exceeds the bounds above.
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
    except (YAMLError, ValueError, OverflowError) as failure:  # a character that YAML forbids: the error has no mark
        raise DocumentError((1, 1), "(not YAML)", f"valid YAML: {' '.join(str(failure).split())}") from failure


class _Builder:
    """Builds nodes from events, one event at a time, so that a bound stops the reader early."""

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
        """Return the node that an alias refers to."""
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


def block_lines(fields: dict[str, Any], indent: str = "") -> Iterator[str]:
    """Yield the lines of a mapping; a list or mapping without nested ones is written on one line."""
    for name, value in fields.items():
        if not any(isinstance(item, dict | list) for item in (value.values() if isinstance(value, dict) else
                                                              value if isinstance(value, list) else ())):
            yield f"{indent}{name}: {_flow(value)}"
            continue
        yield f"{indent}{name}:"
        if isinstance(value, dict):
            yield from block_lines(value, indent + "  ")
            continue
        for item in value:
            first, *rest = block_lines(item, indent + "  ") if isinstance(item, dict) else [f"{indent}  {_flow(item)}"]
            yield f"{indent}- {first.lstrip()}"
            yield from rest


def _flow(value: Any) -> str:
    """Return a value written on one line."""
    if isinstance(value, list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{name}: {_flow(item)}' for name, item in value.items())}}}"
    if isinstance(value, str):
        return value if _PLAIN.fullmatch(value) and value.lower() not in _OTHERWISE else _quoted(value)
    return repr(value) if isinstance(value, float) else json.dumps(value)


def _quoted(text: str) -> str:
    """Return a text in double quotes, with codes for quotes, backslashes and characters that cannot be printed."""
    return '"' + "".join(f"\\U{ord(c):08x}" if c in '"\\' or not c.isprintable() else c for c in text) + '"'
