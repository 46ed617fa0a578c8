"""Convert YAML text to plain values with line and column, and back. Tags are refused; size and depth are bounded.

ruamel composes the text into nodes, which know their places; it never constructs values. So there are only numbers,
texts, truth values, lists and mappings. Scalars follow YAML 1.2 (``1e-3`` is a number, ``yes`` is a text).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from iapb.errors import Mistake, SceneError
from iapb.scene.parts import Path, written

MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 24  # the deepest valid value, a vertex of a body's shape, has depth 7
MAX_NODES = 100_000  # values and field names after expansion of aliases, which could make a small file huge
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_PLAIN = re.compile(r"[A-Za-z_][\w ./()*+-]*(?<! )", re.ASCII)  # a text that needs no quotes in YAML
_OTHERWISE = ("null", "true", "false", "yes", "no", "on", "off", "y", "n")  # these need quotes all the same


class Document:
    """The plain values of a YAML text, with their places.

    Attributes
    ----------
    file : name of the file in messages
    value : the values
    mistakes : one for each field that a mapping has twice
    """

    def __init__(self, text: str, file: str = "(text)", what: str = "scene") -> None:
        """Read a text; `what` names the kind of file in messages.

        Raises
        ------
        SceneError
            The text is not YAML, has tags, or exceeds the bounds above.
        """
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError

        self.file, self._what, self._count = file, what, 0
        self.mistakes: list[Mistake] = []
        self._keys: dict[Path, tuple[int, int]] = {}
        if len(text) > MAX_CHARACTERS:
            raise self._refusal((1, 1), f"{len(text)} characters", f"a file of at most {MAX_CHARACTERS} characters")
        yaml = YAML(typ="safe", pure=True)
        yaml.composer.warn_double_anchors = False
        try:
            root = yaml.compose(text)
        except (YAMLError, ValueError, OverflowError, RecursionError) as failure:
            mark, problem = (getattr(failure, name, None) for name in ("problem_mark", "problem"))
            place = (mark.line + 1, mark.column + 1) if mark else (1, 1)
            said = problem or " ".join(str(failure).split())
            raise self._refusal(place, "(not YAML)", f"valid YAML: {said}") from failure
        self._places: dict[Path, tuple[int, int]] = {(): (1, 1)} if root is None else {}
        self.value = None if root is None else self._plain(root, ())

    def _refusal(self, place: tuple[int, int], value: str, expected: str) -> SceneError:
        return SceneError([Mistake(self.file, *place, "(file)", value, expected)], self._what)

    def _plain(self, node: Any, path: Path) -> Any:
        """Return the value of a node; an alias is expanded wherever it stands."""
        self._count += 1
        place = self._places.setdefault(path, _place(node))
        if self._count > MAX_NODES:
            raise self._refusal(place, f"more than {MAX_NODES} values", "a smaller scene")
        if node.ctag.handle is not None:
            raise self._refusal(place, str(node.ctag), "no tags: a scene is plain numbers, texts and lists")
        if len(path) > MAX_DEPTH:
            raise self._refusal(place, "(nested too deeply)", f"at most {MAX_DEPTH} levels")
        if node.id == "scalar":
            return scalar(node.value) if node.style is None else node.value
        if node.id == "sequence":
            return [self._plain(child, (*path, i)) for i, child in enumerate(node.value)]
        found: dict[str, Any] = {}
        for key, child in node.value:
            if key.id != "scalar":
                raise self._refusal(_place(key), "(not a name)", "the name of a field")
            self._count += 1
            here = (*path, key.value)
            self._keys.setdefault(here, _place(key))
            value = self._plain(child, here)
            if key.value not in found:
                found[key.value] = value
            else:
                self.mistakes.append(Mistake(self.file, *_place(key), written(here), "(repeated)", "each field once"))
        return found

    def place(self, path: Path, key: bool = False) -> tuple[int, int]:
        """Return line and column, from 1, of a value or of its key; if it is absent, of the nearest value around it."""
        if key and path in self._keys:
            return self._keys[path]
        while path not in self._places:
            path = path[:-1]
        return self._places[path]


def _place(node: Any) -> tuple[int, int]:
    return node.start_mark.line + 1, node.start_mark.column + 1


def scalar(text: str) -> Any:
    """Return the value of an unquoted YAML 1.2 scalar: None, a truth value, a number or the text itself."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text


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
    if not isinstance(value, str):
        return repr(value) if isinstance(value, float) else json.dumps(value)
    if _PLAIN.fullmatch(value) and value.lower() not in _OTHERWISE:
        return value
    coded = (f"\\U{ord(c):08x}" if c in '"\\' or not c.isprintable() else c for c in value)
    return f'"{"".join(coded)}"'
