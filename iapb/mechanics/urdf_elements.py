"""Elements of a URDF file, by the standard library's XML parser: the robot, its named parts, numbers and origins."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.rotations import rotation_of
from iapb.mechanics.urdf_spelling import check_spelling

Floats = NDArray[np.float64]

MAX_BYTES = 10_000_000  # the largest of known robots has a tenth
MAX_DEPTH = 32


def _refuse_doctype(*_: object) -> NoReturn:
    raise ArgumentError("URDF file", "<!DOCTYPE", "no document type: it could declare entities without end")


class _Depth:
    """Counts the elements that are open; a URDF has five levels, a file without end as many as it likes."""

    def __init__(self) -> None:
        self.open = 0

    def enter(self, *_: object) -> None:
        self.open += 1
        if self.open > MAX_DEPTH:
            raise ArgumentError("URDF file", f"{self.open} levels", f"at most {MAX_DEPTH} levels of elements")

    def leave(self, *_: object) -> None:
        self.open -= 1


def parse_robot(path: Path) -> ElementTree.Element:
    """Return the robot element; document types, endless depth and slips of spelling are refused.

    Parameters
    ----------
    path : of the URDF file

    Raises
    ------
    ArgumentError
        The file cannot be read, is larger than MAX_BYTES, is no well-formed XML, or no URDF robot.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        why = getattr(error, "strerror", None) or error
        raise ArgumentError("path", str(path), f"a readable URDF file ({why})") from None
    if len(text) > MAX_BYTES:
        raise ArgumentError("URDF file", str(path), f"at most {MAX_BYTES} bytes")
    try:
        depth, scanner = _Depth(), expat.ParserCreate()
        scanner.StartDoctypeDeclHandler = _refuse_doctype
        scanner.StartElementHandler, scanner.EndElementHandler = depth.enter, depth.leave
        scanner.Parse(text, True)
        robot = ElementTree.fromstring(text)
    except (expat.ExpatError, ElementTree.ParseError) as error:
        raise ArgumentError("URDF file", str(path), f"well-formed XML ({error})") from None
    if robot.tag != "robot":
        raise ArgumentError("URDF file", f"<{robot.tag}>", "a <robot> element at the top")
    check_spelling(robot)
    return robot


def elements_by_name(robot: ElementTree.Element, tag: str) -> dict[str, ElementTree.Element]:
    """Return the robot's elements of that tag by name."""
    found: dict[str, ElementTree.Element] = {}
    for element in robot.findall(tag):
        name = element.get("name")
        if not name:
            raise ArgumentError(f"<{tag}> number {len(found) + 1}: name", name, "a name")
        if name in found:
            raise ArgumentError(f"<{tag} name={name!r}>", name, f"a name that no other {tag} has")
        found[name] = element
    return found


def where_of(element: ElementTree.Element) -> str:
    """Return how messages name an element."""
    return f"<{element.tag} name={element.get('name')!r}>"


def numbers_in(where: str, text: str | None, count: int) -> Floats:
    """Return `count` finite numbers from an attribute."""
    try:
        values = np.array([float(word) for word in (text or "").split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        raise ArgumentError(where, text, f"{count} finite number{'s' if count > 1 else ''}")
    return values


def origin_of(owner: ElementTree.Element, where: str) -> tuple[Floats, Floats]:
    """Return (rotation, position) of an optional <origin xyz rpy>; rpy turns about fixed x, then y, then z."""
    element = owner.find("origin")
    if element is None:
        return np.eye(3), np.zeros(3)
    if "quat_xyzw" in element.attrib:
        raise ArgumentError(f"{where} origin quat_xyzw", element.get("quat_xyzw"), "the rotation as rpy")
    position = numbers_in(f"{where} origin xyz", element.get("xyz", "0 0 0"), 3)
    angles = numbers_in(f"{where} origin rpy", element.get("rpy", "0 0 0"), 3)
    return rotation_of(angles) + 0.0, position  # + 0.0: no negative zeros
