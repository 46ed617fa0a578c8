"""Read a URDF file into bodies, by the standard library's XML parser alone.

Independent of Pinocchio's reader, so that a comparison of the two checks the reading, too. Order and layout of
q and v are those of `pin.buildModelFromUrdf`: depth first, children of a link in the alphabetical order of
their joints' names; continuous joints (cos, sin); planar and floating joints as SE(2) and SE(3) with
velocities in body axes; mimic joints independent. Fixed joints stay as bodies without degrees of freedom.
What can touch (<collision>) is no part of a mechanism: `iapb.mechanics.urdf_collision` reads it.
Source of the format: the URDF XML specification (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint
from iapb.mechanics.moving_parts import turned_inertia
from iapb.mechanics.urdf_elements import elements_by_name, numbers_in, origin_of, parse_robot, where_of
from iapb.names import one_of

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
    robot = parse_robot(Path(path))
    links = elements_by_name(robot, "link")
    connections = [_connection(element) for element in elements_by_name(robot, "joint").values()]
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


def _inertial(link: ElementTree.Element) -> _Inertial:
    """Return mass, centre of mass and inertia about it, in link axes; nothing where there is no <inertial>."""
    inertial, where = link.find("inertial"), f"{where_of(link)} inertial"
    if inertial is None:
        return _Inertial()
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None or tensor is None:
        raise ArgumentError(where, "incomplete", "a <mass> and an <inertia>")
    rotation, center = origin_of(inertial, where)
    entries = {
        key: numbers_in(f"{where} inertia {key}", tensor.get(key), 1)[0]
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    matrix = np.array([[entries["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    turned = turned_inertia(rotation, matrix)
    value = float(numbers_in(f"{where} mass", mass.get("value"), 1)[0])
    if value < 0.0:
        raise ArgumentError(f"{where} mass", value, "at least 0 kg")
    return _Inertial(value, center, 0.5 * (turned + turned.T))


def _connection(element: ElementTree.Element) -> _Connection:
    """Return a joint with the links it connects."""
    where, kind = where_of(element), element.get("type", "")
    if kind not in KIND_OF_TYPE:
        raise ArgumentError(f"{where} type", kind, one_of(kind, KIND_OF_TYPE))
    ends = {tag: element.find(tag) for tag in ("parent", "child")}
    names = {tag: end.get("link") if end is not None else None for tag, end in ends.items()}
    for tag, name in names.items():
        if not name:
            raise ArgumentError(f"{where} {tag}", name, f'<{tag} link="..."/>')
    axis = np.array(DEFAULT_AXIS)
    if kind in WITH_AXIS and (given := element.find("axis")) is not None:
        axis = numbers_in(f"{where} axis", given.get("xyz"), 3)
        if not axis.any():
            raise ArgumentError(f"{where} axis", given.get("xyz"), "a vector that is not zero")
    joint = Joint(KIND_OF_TYPE[kind], (float(axis[0]), float(axis[1]), float(axis[2])))
    name = element.get("name") or ""
    return _Connection(name, str(names["parent"]), str(names["child"]), joint, origin_of(element, where))


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
