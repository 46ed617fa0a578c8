"""Read a URDF file into bodies, with the standard library's XML parser alone.

The reader is independent of Pinocchio's, so a comparison of the two also checks the reading. Order
and layout of q and v are those of `pin.buildModelFromUrdf`: depth first, children of a link in the
alphabetical order of their joints' names; continuous joints (cos, sin); floating joints as SE(3)
with velocities in body axes; mimic joints independent. Only planar joints differ: they are the
engine's own `planar`. Fixed joints stay as bodies without degrees of freedom. Elements of shapes,
<visual> and <collision>, are ignored. Source of the format: the URDF XML specification
(wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import difflib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from iapb.errors import ArgumentError
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint
from iapb.mechanics.rotations import rotation_of
from iapb.mechanics.structure import turned_inertia
from iapb.names import one_of
from iapb.schema import Floats

WITH_AXIS = ("revolute", "continuous", "prismatic")
KIND_OF_TYPE = {
    **{kind: kind for kind in ("fixed", *WITH_AXIS, "planar")},
    "floating": "free_flyer",
}
# children that are read, and attributes, of the elements that have any
_CHILDREN: dict[str, tuple[str, ...]] = {
    "robot": ("link", "joint"),
    "link": ("inertial",),
    "joint": ("origin", "parent", "child", "axis"),
    "inertial": ("origin", "mass", "inertia"),
}
_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "axis": ("xyz",),
    "parent": ("link",),
    "child": ("link",),
}
_MANY = ("link", "joint")  # an element may hold several of these
_NEAR = (
    0.75  # share of letters that agree: inertail is an error, contact and visual are other words
)
MAX_BYTES = 10_000_000  # the largest known robot file has a tenth of this


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
        The file cannot be read, is not a URDF robot, or one of its elements is wrong; the message
        names the file, the element and what was expected.
    """
    robot = parse_robot(Path(path))
    inertials = {
        name: _inertial(element) for name, element in elements_by_name(robot, "link").items()
    }
    held: dict[
        str, tuple[str, Joint, tuple[Floats, Floats]]
    ] = {}  # link -> parent, joint and placement
    children: dict[str, list[str]] = {name: [] for name in inertials}
    for _, element in sorted(
        elements_by_name(robot, "joint").items(), key=lambda item: item[0].encode()
    ):
        where, ends = where_of(element), {tag: element.find(tag) for tag in ("parent", "child")}
        parent, child = ("" if end is None else end.get("link", "") for end in ends.values())
        for tag, link in zip(ends, (parent, child), strict=True):
            if link not in inertials:
                raise ArgumentError(
                    f"{where} {tag}", link, f'<{tag} link="..."/> with the name of a <link>'
                )
        if child in held:
            raise ArgumentError(
                f"{where} child", child, "a link that is the child of no other joint"
            )
        held[child] = parent, _joint(element), origin_of(element, where)
        children[parent].append(child)
    roots = [name for name in inertials if name not in held]
    if len(roots) != 1:
        raise ArgumentError("links without a parent", roots, "exactly one, the root")
    bodies = [
        Body(
            roots[0],
            None,
            Joint("free_flyer" if floating_base else "fixed"),
            _HERE,
            *inertials[roots[0]],
        )
    ]
    stack = children[roots[0]][::-1]  # instead of recursion, for any depth
    while stack:
        link = stack.pop()
        bodies.append(Body(link, *held[link], *inertials[link]))
        stack.extend(children[link][::-1])
    if lost := sorted(inertials.keys() - {body.name for body in bodies}):
        raise ArgumentError(
            "links",
            lost,
            f"joints that connect each link to the root {roots[0]!r}; the joints of "
            "these links form a loop",
        )
    return bodies


_HERE = (np.eye(3), np.zeros(3))


def _inertial(link: ElementTree.Element) -> tuple[Any, ...]:
    """Return mass, centre of mass and inertia about it, in link axes; nothing if there is no
    <inertial>."""
    inertial, where = link.find("inertial"), f"{where_of(link)} inertial"
    if inertial is None:
        return ()
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None or tensor is None:
        raise ArgumentError(where, "incomplete", "a <mass> and an <inertia>")
    rotation, center = origin_of(inertial, where)
    matrix = np.array(
        [
            [numbers_in(f"{where} inertia {key}", tensor.get(key), 1)[0] for key in keys.split()]
            for keys in ("ixx ixy ixz", "ixy iyy iyz", "ixz iyz izz")
        ]
    )
    turned = turned_inertia(rotation, matrix)
    return numbers_in(f"{where} mass", mass.get("value"), 1)[0], center, 0.5 * (turned + turned.T)


def _joint(element: ElementTree.Element) -> Joint:
    where, kind, axis = where_of(element), element.get("type", ""), element.find("axis")
    if kind not in KIND_OF_TYPE:
        raise ArgumentError(f"{where} type", kind, one_of(kind, KIND_OF_TYPE))
    along = np.array((1.0, 0.0, 0.0))  # default of the specification
    if kind in WITH_AXIS and axis is not None:
        along = numbers_in(f"{where} axis", axis.get("xyz"), 3)
        if not along.any():
            raise ArgumentError(f"{where} axis", axis.get("xyz"), "a vector that is not zero")
    return Joint(KIND_OF_TYPE[kind], (float(along[0]), float(along[1]), float(along[2])))


class _Builder(ElementTree.TreeBuilder):
    """Builds the elements of a file, but refuses entities, which a malicious one could contain."""

    def doctype(self, *_: object) -> NoReturn:
        raise ArgumentError(
            "URDF file", "<!DOCTYPE", "no <!DOCTYPE>: its entities can expand without limit"
        )


def parse_robot(path: Path) -> ElementTree.Element:
    """Return the robot element of a URDF file; an ArgumentError says what is wrong with the
    file."""
    try:
        if path.exists() and not path.is_file():
            raise ValueError("no regular file")  # a pipe would be waited for
        with path.open("rb") as file:
            text = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        why = getattr(error, "strerror", None) or error
        raise ArgumentError("path", str(path), f"a readable URDF file ({why})") from None
    if len(text) > MAX_BYTES:
        raise ArgumentError("URDF file", str(path), f"at most {MAX_BYTES} bytes")
    try:
        parser = ElementTree.XMLParser(target=_Builder())
        parser.feed(text)
        robot: ElementTree.Element = parser.close()
    except ArgumentError:
        raise
    except (
        ElementTree.ParseError,
        LookupError,
        ValueError,
    ) as error:  # also of an encoding that Python has, or not
        raise ArgumentError("URDF file", str(path), f"well-formed XML ({error})") from None
    if robot.tag != "robot":
        raise ArgumentError("URDF file", f"<{robot.tag}>", "a <robot> element at the top")
    _check_spelling(robot, "<robot>")
    return robot


def _check_spelling(element: ElementTree.Element, where: str) -> None:
    """Raise ArgumentError for a misspelt element, an unknown attribute or a repeated element of
    what is read.

    Elements of other tools (<gazebo>, <transmission>, <contact> …) are allowed, as the format
    intends. A name that nearly equals an element that is read counts as an error: otherwise a link
    could lose its mass without a message.
    """
    read, attributes = (table.get(str(element.tag), ()) for table in (_CHILDREN, _ATTRIBUTES))
    for name, value in element.attrib.items():
        if (
            attributes and name not in attributes and not name.startswith("{")
        ):  # {…}: of another XML namespace
            raise ArgumentError(
                f"{where} {name}", value, one_of(name, attributes, "one of its attributes: ")
            )
    seen: set[str] = set()
    for child in element:
        tag = str(child.tag)
        if tag in seen and tag not in _MANY:
            raise ArgumentError(f"{where} <{tag}>", "given twice", "one of them")
        if tag in read:
            seen.add(tag)
            _check_spelling(child, where_of(child) if element.tag == "robot" else f"{where} {tag}")
        elif near := difflib.get_close_matches(tag, read, n=1, cutoff=_NEAR):
            raise ArgumentError(
                f"{where} <{tag}>", tag, f"<{near[0]}>; is it misspelt? Rename it if not"
            )


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
    """Return (rotation, position) of an optional <origin xyz rpy>; rpy rotates about fixed x, then
    y, then z."""
    element = owner.find("origin")
    if element is None:
        return _HERE
    if "quat_xyzw" in element.attrib:
        raise ArgumentError(
            f"{where} origin quat_xyzw", element.get("quat_xyzw"), "the rotation as rpy"
        )
    position = numbers_in(f"{where} origin xyz", element.get("xyz", "0 0 0"), 3)
    angles = numbers_in(f"{where} origin rpy", element.get("rpy", "0 0 0"), 3)
    return rotation_of(angles) + 0.0, position  # + 0.0: no negative zeros
