"""Read a URDF file into bodies, by the standard library's XML parser alone.

Independent of Pinocchio's reader, so that a comparison of the two checks the reading, too. Order and layout of
q and v are those of `pin.buildModelFromUrdf`: depth first, children of a link in the alphabetical order of
their joints' names; continuous joints (cos, sin); planar and floating joints as SE(2) and SE(3) with
velocities in body axes; mimic joints independent. Fixed joints stay as bodies without degrees of freedom.
Source of the format: the URDF XML specification (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple, NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint

Floats = NDArray[np.float64]

KIND_OF_TYPE = {
    "fixed": "fixed",
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
    "planar": "planar_se2",
    "floating": "free_flyer",
}
WITH_AXIS = ("revolute", "continuous", "prismatic")
DEFAULT_AXIS = (1.0, 0.0, 0.0)  # of the specification


class _Inertial(NamedTuple):
    mass: float = 0.0
    center_of_mass: Floats = np.zeros(3)
    inertia: Floats = np.zeros((3, 3))


class _Connection(NamedTuple):
    """A joint element: which links it connects, and how."""

    name: str
    parent: str
    child: str
    joint: Joint
    placement: tuple[Floats, Floats]


def read_urdf(path: str | Path, floating_base: bool = False) -> list[Body]:
    """Return the robot's links as bodies, parents first.

    Parameters
    ----------
    path : path of the URDF file
    floating_base : bool
        True: the root link moves freely (free flyer); False: it is fixed to the world.

    Raises
    ------
    ArgumentError
        The file cannot be read, is not a URDF robot, or one of its elements is wrong; the message names the
        file, the element and what was expected.
    """
    robot = _parse(Path(path))
    links = _unique(robot, "link")
    connections = [_connection(element) for element in _unique(robot, "joint").values()]
    inertials = {name: _inertial(element) for name, element in links.items()}
    root = _root(connections, inertials)
    base = Joint("free_flyer" if floating_base else "fixed")
    bodies = [Body(root, None, base, (np.eye(3), np.zeros(3)), *inertials[root])]
    for connection in _depth_first(connections, root):
        child, placement = connection.child, connection.placement
        bodies.append(Body(child, connection.parent, connection.joint, placement, *inertials[child]))
    if len(bodies) < len(links):
        lost = sorted(set(links) - {body.name for body in bodies})
        raise ArgumentError(
            "links", lost, f"links connected to the root {root!r}, not to one another in a ring"
        )
    return bodies


def _refuse_doctype(*_: object) -> NoReturn:
    raise ArgumentError("URDF file", "<!DOCTYPE", "no document type: it could declare entities without end")


def _parse(path: Path) -> ElementTree.Element:
    """Return the robot element; document types are refused before anything is expanded."""
    try:
        text = path.read_bytes()
        scanner = expat.ParserCreate()
        scanner.StartDoctypeDeclHandler = _refuse_doctype
        scanner.Parse(text, True)
        robot = ElementTree.fromstring(text)
    except OSError as error:
        raise ArgumentError("path", str(path), f"a readable URDF file ({error.strerror})") from None
    except (expat.ExpatError, ElementTree.ParseError) as error:
        raise ArgumentError("URDF file", str(path), f"well-formed XML ({error})") from None
    if robot.tag != "robot":
        raise ArgumentError("URDF file", f"<{robot.tag}>", "a <robot> element at the top")
    return robot


def _unique(robot: ElementTree.Element, tag: str) -> dict[str, ElementTree.Element]:
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


def _where(element: ElementTree.Element) -> str:
    return f"<{element.tag} name={element.get('name')!r}>"


def _numbers(where: str, text: str | None, count: int) -> Floats:
    """Return `count` finite numbers from an attribute."""
    try:
        values = np.array([float(word) for word in (text or "").split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        raise ArgumentError(where, text, f"{count} finite number{'s' if count > 1 else ''}")
    return values


def _origin(owner: ElementTree.Element, where: str) -> tuple[Floats, Floats]:
    """Return (rotation, position) of an optional <origin xyz rpy>; rpy turns about fixed x, then y, then z."""
    element = owner.find("origin")
    if element is None:
        return np.eye(3), np.zeros(3)
    if "quat_xyzw" in element.attrib:
        raise ArgumentError(f"{where} origin quat_xyzw", element.get("quat_xyzw"), "the rotation as rpy")
    position = _numbers(f"{where} origin xyz", element.get("xyz", "0 0 0"), 3)
    roll, pitch, yaw = _numbers(f"{where} origin rpy", element.get("rpy", "0 0 0"), 3)
    return _turn(2, yaw) @ _turn(1, pitch) @ _turn(0, roll), position


def _turn(axis: int, angle: float) -> Floats:
    """Rotation about a coordinate axis."""
    rotation, i, j = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    rotation[i, i] = rotation[j, j] = math.cos(angle)
    rotation[j, i] = math.sin(angle)
    rotation[i, j] = -rotation[j, i]
    return rotation


def _inertial(link: ElementTree.Element) -> _Inertial:
    """Return mass, centre of mass and inertia about it, in link axes; nothing where there is no <inertial>."""
    inertial, where = link.find("inertial"), f"{_where(link)} inertial"
    if inertial is None:
        return _Inertial()
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None or tensor is None:
        raise ArgumentError(where, "incomplete", "a <mass> and an <inertia>")
    rotation, center = _origin(inertial, where)
    entries = {
        key: _numbers(f"{where} inertia {key}", tensor.get(key), 1)[0]
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    matrix = np.array([[entries["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    turned = rotation @ matrix @ rotation.T
    value = float(_numbers(f"{where} mass", mass.get("value"), 1)[0])
    if value < 0.0:
        raise ArgumentError(f"{where} mass", value, "at least 0 kg")
    return _Inertial(value, center, 0.5 * (turned + turned.T))


def _connection(element: ElementTree.Element) -> _Connection:
    """Return a joint with the links it connects."""
    where, kind = _where(element), element.get("type", "")
    if kind not in KIND_OF_TYPE:
        raise ArgumentError(f"{where} type", kind, f"one of {', '.join(KIND_OF_TYPE)}")
    ends = {tag: element.find(tag) for tag in ("parent", "child")}
    names = {tag: end.get("link") if end is not None else None for tag, end in ends.items()}
    for tag, name in names.items():
        if not name:
            raise ArgumentError(f"{where} {tag}", name, f'<{tag} link="..."/>')
    axis = np.array(DEFAULT_AXIS)
    if kind in WITH_AXIS and (given := element.find("axis")) is not None:
        axis = _numbers(f"{where} axis", given.get("xyz"), 3)
        if not axis.any():
            raise ArgumentError(f"{where} axis", given.get("xyz"), "a vector that is not zero")
    joint = Joint(KIND_OF_TYPE[kind], (float(axis[0]), float(axis[1]), float(axis[2])))
    name = element.get("name") or ""
    return _Connection(name, str(names["parent"]), str(names["child"]), joint, _origin(element, where))


def _root(connections: list[_Connection], links: dict[str, _Inertial]) -> str:
    """Return the one link that is nobody's child."""
    parent_of: dict[str, str] = {}
    for connection in connections:
        where = f"<joint name={connection.name!r}>"
        for tag, link in (("parent", connection.parent), ("child", connection.child)):
            if link not in links:
                raise ArgumentError(f"{where} {tag}", link, "the name of a <link>")
        if connection.child in parent_of:
            raise ArgumentError(f"{where} child", connection.child, "a link that no other joint carries")
        parent_of[connection.child] = connection.parent
    roots = [name for name in links if name not in parent_of]
    if len(roots) != 1:
        raise ArgumentError("links without a parent", roots, "exactly one, the root")
    return roots[0]


def _depth_first(connections: list[_Connection], root: str) -> list[_Connection]:
    """Return the joints depth first, siblings by name; a stack, so that depth has no limit."""
    children: dict[str, list[_Connection]] = {}
    for connection in sorted(connections, key=lambda c: c.name.encode(), reverse=True):
        children.setdefault(connection.parent, []).append(connection)
    order: list[_Connection] = []
    stack = list(children.get(root, []))
    while stack:
        connection = stack.pop()
        order.append(connection)
        stack.extend(children.get(connection.child, []))
    return order
