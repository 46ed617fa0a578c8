"""Convert YAML text to plain values with line and column, and back. Tags are refused; size and
depth are bounded.

ruamel composes the text into nodes, which know their places; it never constructs values. So there
are only numbers, texts, truth values, lists and mappings. Scalars follow YAML 1.2 (``1e-3`` is a
number, ``yes`` is a text).
"""

from __future__ import annotations

import re
from ast import literal_eval
from functools import lru_cache
from io import StringIO
from typing import Any

from iapb.errors import Mistake, SceneError
from iapb.scene.parts import Path, written

MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 24  # the deepest valid value, a vertex of a body's shape, has depth 7
# values and field names after expansion of aliases, which could make a small file huge
MAX_NODES = 100_000
_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS: dict[str, Any] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}


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

        self.file = file
        self._what = what
        self._count = 0
        self.mistakes: list[Mistake] = []
        self._keys: dict[Path, tuple[int, int]] = {}
        if len(text) > MAX_CHARACTERS:
            raise self._refusal(
                (1, 1), f"{len(text)} characters", f"a file of at most {MAX_CHARACTERS} characters"
            )
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
            raise self._refusal(
                place, str(node.ctag), "no tags: a scene is plain numbers, texts and lists"
            )
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
                self.mistakes.append(
                    Mistake(self.file, *_place(key), written(here), "(repeated)", "each field once")
                )
        return found

    def place(self, path: Path, key: bool = False) -> tuple[int, int]:
        """Return line and column, from 1, of a value or of its key; if it is absent, of the nearest
        value around it."""
        if key and path in self._keys:
            return self._keys[path]
        while path not in self._places:
            path = path[:-1]
        return self._places[path]


def _place(node: Any) -> tuple[int, int]:
    return node.start_mark.line + 1, node.start_mark.column + 1


def scalar(text: str) -> Any:
    """Return the value of an unquoted YAML 1.2 scalar: None, a truth value, a number or the text
    itself."""
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text


def yaml_text(fields: dict[str, Any]) -> str:
    """Return the fields of a scene as YAML; a list or mapping without nested ones is written on one
    line."""
    return "".join(_field_text(repr({name: value, "": [[]]})) for name, value in fields.items())


@lru_cache(1000)  # scenes that differ in a few values share the other fields, of 20 ms
def _field_text(field: str) -> str:
    from ruamel.yaml import YAML, SafeRepresenter

    class Plain(SafeRepresenter):
        def ignore_aliases(self, data: Any) -> bool:
            return True

        def represent_str(self, text: str) -> Any:  # in quotes if `scalar` would read a number
            return self.represent_scalar(
                "tag:yaml.org,2002:str", text, None if scalar(text) == text else '"'
            )

    Plain.add_representer(str, Plain.represent_str)
    text, yaml = StringIO(), YAML(typ="safe", pure=True)  # type: tuple[StringIO, Any]
    yaml.Representer = Plain
    yaml.default_flow_style = None
    yaml.width = 1_000_000
    yaml.sort_base_mapping_type_on_output = False
    # with a nested list, or a single field would be written in braces
    yaml.dump(literal_eval(field), text)
    return text.getvalue().rpartition('"":')[0]
