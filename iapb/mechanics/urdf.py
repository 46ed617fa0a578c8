"""Read a URDF file into bodies, with the standard library's XML parser alone.

The reader is independent of Pinocchio's, so a comparison of the two also checks the reading. Order and layout of
q and v are those of `pin.buildModelFromUrdf`: depth first, children of a link in the alphabetical order of
their joints' names; continuous joints (cos, sin); planar and floating joints as SE(2) and SE(3) with
velocities in body axes; mimic joints independent. Fixed joints stay as bodies without degrees of freedom.
Shapes for contact (<collision>) are not part of a mechanism: `read_collisions` reads them.
Source of the format: the URDF XML specification (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import difflib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple, NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint
from iapb.mechanics.rotations import rotation_of
from iapb.mechanics.structure import turned_inertia
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
DEFAULT_AXIS = (1.0, 0.0, 0.0)  # default of the specification


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
            "links", lost, f"joints that connect each link to the root {root!r}; the joints of these links form a loop"
        )
    return bodies


def _inertial(link: ElementTree.Element) -> _Inertial:
    """Return mass, centre of mass and inertia about it, in link axes; zeros if there is no <inertial>."""
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
    """Return the only link that is not the child of a joint."""
    parent_of: dict[str, str] = {}
    for connection in connections:
        where = f"<joint name={connection.name!r}>"
        for tag, link in (("parent", connection.parent), ("child", connection.child)):
            if link not in links:
                raise ArgumentError(f"{where} {tag}", link, "the name of a <link>")
        if connection.child in parent_of:
            raise ArgumentError(f"{where} child", connection.child, "a link that is the child of no other joint")
        parent_of[connection.child] = connection.parent
    roots = [name for name in links if name not in parent_of]
    if len(roots) != 1:
        raise ArgumentError("links without a parent", roots, "exactly one, the root")
    return roots[0]


def _depth_first(connections: list[_Connection], root: str) -> list[_Connection]:
    """Return the joints depth first, siblings ordered by name; a stack instead of recursion allows any depth."""
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


# The <collision> elements of a URDF file: the contact shapes of each link, in link axes.
#
# All five geometries of the format are read; the scene decides which of them it accepts.
# Source of the format: the URDF XML specification (wiki.ros.org/urdf/XML/link); <capsule> as in ROS 2.

# geometry -> its attributes that are lengths, and how many numbers each holds
LENGTHS = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {},
}


class CollisionShape(NamedTuple):
    """One <collision> element of a link.

    kind : box, sphere, cylinder, capsule or mesh
    lengths : [m] full sides of a box (3,), radius of a sphere (1,), radius and length (2,) of cylinder and capsule;
    a mesh has none
    rotation, center : (3, 3) and (3,) [m] of the shape's own axes, in link axes
    """

    kind: str
    lengths: Floats
    rotation: Floats
    center: Floats


def read_collisions(path: str | Path) -> dict[str, tuple[CollisionShape, ...]]:
    """Return the shapes of every link, in the order of the file; links without any have an empty tuple.

    Raises
    ------
    ArgumentError
        The file is not a URDF robot, or a collision element is wrong; the message names link and element.
    """
    links = elements_by_name(parse_robot(Path(path)), "link")
    return {
        name: tuple(_shape(element, f"{where_of(link)} collision") for element in link.findall("collision"))
        for name, link in links.items()
    }


def _shape(collision: ElementTree.Element, where: str) -> CollisionShape:
    geometry = collision.find("geometry")
    kinds = [] if geometry is None else list(geometry)
    if len(kinds) != 1 or kinds[0].tag not in LENGTHS:
        found = ", ".join(f"<{kind.tag}>" for kind in kinds) or "nothing"
        raise ArgumentError(f"{where} geometry", found, one_of(found, [f"<{kind}>" for kind in LENGTHS]))
    kind = kinds[0]
    values = [
        numbers_in(f"{where} {kind.tag} {name}", kind.get(name), count) for name, count in LENGTHS[kind.tag].items()
    ]
    lengths = np.concatenate([np.zeros(0), *values])
    if (lengths <= 0.0).any():
        raise ArgumentError(f"{where} {kind.tag}", lengths.tolist(), "lengths > 0 m")
    return CollisionShape(kind.tag, lengths, *origin_of(collision, where))


# Elements of a URDF file, by the standard library's XML parser: the robot, its named parts, numbers and origins.


MAX_BYTES = 10_000_000  # the largest known robot file has a tenth of this
MAX_DEPTH = 32


def _refuse_doctype(*_: object) -> NoReturn:
    raise ArgumentError("URDF file", "<!DOCTYPE", "no <!DOCTYPE>: its entities can expand without limit")


class _Depth:
    """Counts the open elements: a URDF has five levels, a malicious file could nest without limit."""

    def __init__(self) -> None:
        self.open = 0

    def enter(self, *_: object) -> None:
        self.open += 1
        if self.open > MAX_DEPTH:
            raise ArgumentError("URDF file", f"{self.open} levels", f"at most {MAX_DEPTH} levels of elements")

    def leave(self, *_: object) -> None:
        self.open -= 1


def parse_robot(path: Path) -> ElementTree.Element:
    """Return the robot element; raise for a document type, too deep nesting or a misspelt name.

    Parameters
    ----------
    path : path of the URDF file

    Raises
    ------
    ArgumentError
        The file cannot be read, is larger than MAX_BYTES, is not well-formed XML, or is not a URDF robot.
    """
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise ValueError("no regular file")  # a pipe would be waited for
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
    """Return the name of an element for error messages."""
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
    """Return (rotation, position) of an optional <origin xyz rpy>; rpy rotates about fixed x, then y, then z."""
    element = owner.find("origin")
    if element is None:
        return np.eye(3), np.zeros(3)
    if "quat_xyzw" in element.attrib:
        raise ArgumentError(f"{where} origin quat_xyzw", element.get("quat_xyzw"), "the rotation as rpy")
    position = numbers_in(f"{where} origin xyz", element.get("xyz", "0 0 0"), 3)
    angles = numbers_in(f"{where} origin rpy", element.get("rpy", "0 0 0"), 3)
    return rotation_of(angles) + 0.0, position  # + 0.0: no negative zeros


# Spelling errors in a URDF file. Without this check a misspelt element, an unknown attribute or a repeated element
# would be ignored silently.
#
# Elements of other tools (<gazebo>, <transmission>, <contact> …) are allowed, as the format intends. A name that nearly
# equals an element that is read counts as a spelling error: otherwise a link could lose its mass without a message.

# element: (children that are read, children of the format that are not)
_CHILDREN: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "robot": (("link", "joint"), ("material", "transmission", "gazebo")),
    "link": (("inertial", "collision"), ("visual", "contact", "sensor")),
    "inertial": (("origin", "mass", "inertia"), ()),
    "joint": (("origin", "parent", "child", "axis"),
              ("calibration", "dynamics", "limit", "mimic", "safety_controller", "hardwareInterface")),
    "collision": (("origin", "geometry"), ("material", "verbose")),
}
_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "axis": ("xyz",),
    "parent": ("link",),
    "child": ("link",),
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
_MANY = ("link", "joint", "collision")  # an element may hold several of these
_NEAR = 0.75  # share of letters that agree: inertail and colision are errors, contact is another word


def check_spelling(robot: ElementTree.Element) -> None:
    """Raise ArgumentError for the first spelling error in the parts of a robot that are read."""
    _check(robot, "<robot>")
    for part in robot:
        if part.tag in ("link", "joint"):
            _check(part, f"<{part.tag} name={part.get('name')!r}>")


def _check(element: ElementTree.Element, where: str) -> None:
    read, others = _CHILDREN.get(str(element.tag), ((), ()))
    seen: set[str] = set()
    for child in element:
        tag = str(child.tag)
        if tag in seen and tag not in _MANY:
            raise ArgumentError(f"{where} <{tag}>", "given twice", "one of them")
        near = difflib.get_close_matches(tag, read, n=1, cutoff=_NEAR)
        if tag not in read and tag not in others and near:
            raise ArgumentError(f"{where} <{tag}>", tag, f"<{near[0]}>; is it misspelt? Rename it if not")
        if tag not in read:
            continue
        seen.add(tag)
        _check_attributes(child, f"{where} {tag}")
        if element.tag != "robot":
            _check(child, f"{where} {tag}")
        if tag == "geometry":
            for shape in child:
                _check_attributes(shape, f"{where} {shape.tag}")


def _check_attributes(element: ElementTree.Element, where: str) -> None:
    known = _ATTRIBUTES.get(str(element.tag))
    if known is None:
        return
    for name, value in element.attrib.items():
        if name not in known and not name.startswith("{"):  # attributes of other XML namespaces are allowed
            raise ArgumentError(f"{where} {name}", value, one_of(name, known, "one of its attributes: "))
