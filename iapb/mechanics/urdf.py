"""Read a URDF file into bodies, with the standard library's XML parser alone.

The reader is independent of Pinocchio's, so a comparison of the two also checks the reading. Order
and layout of q and v are those of `pin.buildModelFromUrdf`: depth first, children of a link in the
alphabetical order of their joints' names; continuous joints (cos, sin); floating joints as SE(3)
with velocities in body axes; mimic joints without coordinates of their own. Only planar joints differ: they are the
engine's own `planar`, in the plane across their axis. Fixed joints stay as bodies without degrees
of freedom.

Nothing is ignored in silence. What changes the motion and has no counterpart here is refused by
name; `leave_out` leaves it out. Elements and attributes of other tools are counted in a remark:
shapes, efforts, speeds, transmissions, simulators. Source of the format: the URDF XML
specification (wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import difflib
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from iapb.errors import ArgumentError, counted
from iapb.mechanics.bodies import Body
from iapb.mechanics.joints import Joint, Mimic
from iapb.mechanics.rotations import frame_along, rotation_of
from iapb.mechanics.structure import turned_inertia
from iapb.names import bytes_of, one_of
from iapb.numerics.linalg import product
from iapb.numerics.schema import Floats

WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
WITH_RANGE = ("revolute", "prismatic")
WITH_DYNAMICS = ("revolute", "continuous", "prismatic")
KIND_OF_TYPE = {kind: kind for kind in ("fixed", *WITH_AXIS)} | {"floating": "free_flyer"}
# children that are read, and attributes, of the elements that are read
_CHILDREN: dict[str, tuple[str, ...]] = {
    "robot": ("link", "joint"),
    "link": ("inertial",),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    "inertial": ("origin", "mass", "inertia"),
}
_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "robot": ("name", "version"),
    "link": ("name",),
    "joint": ("name", "type"),
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "axis": ("xyz",),
    "parent": ("link",),
    "child": ("link",),
    "limit": ("lower", "upper"),
    "dynamics": ("damping", "friction"),
    "mimic": ("joint", "multiplier", "offset"),
}
_MANY = ("link", "joint")  # an element may hold several of these
_SHAPES = ("visual", "collision")
# share of letters that agree: inertail and xzy are errors, contact and rpy of an axis other words
_NEAR = 0.75
_NEAR_ATTRIBUTE = 0.6
MAX_BYTES = 10_000_000  # the largest known robot file has a tenth of this
FARTHEST = 1e9  # m, rad: a bound beyond it is none, as of rotors that say 1e16

LeaveOut = Mapping[str, Sequence[str]]


class Link(NamedTuple):
    """A link, and what its joint has beside its kind."""

    body: Body
    name: str = ""  # of the link, where the body takes the start of its joint
    joint: str = ""  # name of this joint
    limits: tuple[float, float] | None = None  # [m, rad]
    damping: float = 0.0  # [N s/m, N m s/rad]
    friction: float = 0.0  # [N, N m]


class UrdfRobot(NamedTuple):
    """The links of a robot, parents first, and sentences on what its file says in vain."""

    links: list[Link]
    remarks: tuple[str, ...]


def read_urdf(path: str | Path, floating_base: bool = False) -> list[Body]:
    """Return the robot's links as bodies, parents first; see `read_robot`."""
    return [link.body for link in read_robot(path, floating_base).links]


def read_robot(
    path: str | Path, floating_base: bool = False, leave_out: LeaveOut | None = None
) -> UrdfRobot:
    """Return the robot's links with limits, damping and friction of their joints.

    Parameters
    ----------
    path : path of the URDF file
    floating_base : bool
        True: the root link moves freely (free flyer); False: it is fixed to the world.
    leave_out : mapping
        Parts of joints to leave out, by joint: limit, dynamics, mimic, or joint: it is welded, or
        taken away if another joint carries its child.

    Raises
    ------
    ArgumentError
        The file cannot be read, is not a URDF robot, or one of its elements is wrong or without a
        counterpart; the message names the file, the element and what was expected.
    """
    robot, ignored = parse_robot(Path(path))
    _leave_out(robot, leave_out or {})
    inertials = {
        name: _inertial(element) for name, element in elements_by_name(robot, "link").items()
    }
    joints = elements_by_name(robot, "joint")
    held: dict[str, Link] = {}  # links that a joint carries
    children: dict[str, list[str]] = {name: [] for name in inertials}
    for name, element in sorted(joints.items(), key=lambda item: item[0].encode()):
        where = where_of(element)
        parent, child = (_end(element, tag, inertials) for tag in ("parent", "child"))
        if child in held:
            raise ArgumentError(
                f"{where} child",
                child,
                f"a link that is the child of no other joint, for loops are not simulated; "
                f"{_leaving(name, 'joint')}",
            )
        body = Body(child, parent, _joint(element), origin_of(element, where), *inertials[child])
        held[child] = _link(element, body, joints, ignored)
        children[parent].append(child)
    _refuse_empty_ranges(held.values())
    roots = [name for name in inertials if name not in held]
    if len(roots) != 1:
        raise ArgumentError("links without a parent", roots, "exactly one, the root")
    base = Joint("free_flyer" if floating_base else "fixed")
    held[roots[0]] = Link(Body(roots[0], None, base, _HERE, *inertials[roots[0]]), roots[0])
    # instead of recursion, for any depth
    stack = roots
    reached = list[str]()
    while stack:
        reached.append(stack.pop())
        stack += reversed(children[reached[-1]])
    if lost := sorted(inertials.keys() - reached):
        raise ArgumentError(
            "links",
            lost,
            f"joints that connect each link to the root {reached[0]!r}; the joints of "
            "these links form a loop",
        )
    links = [link for name in reached for link in _with_plane(held[name])]
    return UrdfRobot(links, _remarks(joints, ignored))


_HERE = (np.eye(3), np.zeros(3))


def _leave_out(robot: ElementTree.Element, leave_out: LeaveOut) -> None:
    """Take away the parts of joints that are left out; weld a joint whose child no other one
    carries."""
    joints = elements_by_name(robot, "joint")
    ends = [child.get("link") for child in robot.findall("joint/child")]
    for name, parts in leave_out.items():
        if name not in joints:
            raise ArgumentError("leave_out", name, one_of(name, joints, "a joint of it: "))
        joint = joints[name]
        for part in joint.findall("*"):
            if part.tag in parts:
                joint.remove(part)
        if "joint" in parts:
            child = joint.find("child")
            if child is not None and ends.count(child.get("link")) > 1:
                robot.remove(joint)
            joint.set("type", "fixed")


def _leaving(joint: str | None, part: str) -> str:
    return f"leave_out: {{{joint}: [{part}]}} leaves it out"


def _end(joint: ElementTree.Element, tag: str, links: Mapping[str, Any]) -> str:
    """Return the name of a joint's parent or child."""
    end = joint.find(tag)
    link = "" if end is None else end.get("link", "")
    if link not in links:
        raise ArgumentError(
            f"{where_of(joint)} {tag}", link, f'<{tag} link="..."/> with the name of a <link>'
        )
    return link


def _with_plane(link: Link) -> list[Link]:
    """Return the link; a planar joint across another axis than z first gets a frame with this
    axis."""
    body = link.body
    if body.joint.kind != "planar" or body.joint.axis == (0.0, 0.0, 1.0):
        return [link]
    turn = frame_along(body.joint.axis)
    rotation, position = body.placement
    frame = Body(
        f"{body.name}_plane", body.parent, Joint("planar"), (product(rotation, turn), position)
    )
    inertial = body.mass, body.center_of_mass, body.inertia
    fixed = Body(body.name, frame.name, Joint("fixed"), (turn.T + 0.0, np.zeros(3)), *inertial)
    return [link._replace(body=frame), Link(fixed)]


def _link(
    joint: ElementTree.Element,
    body: Body,
    joints: dict[str, ElementTree.Element],
    ignored: Counter[str],
) -> Link:
    """Return a body with what its joint has beside its kind."""
    damping, friction = (_dynamics(joint, name, ignored) for name in ("damping", "friction"))
    name = str(joint.get("name"))
    if mimic := _mimic(joint, joints, ignored):
        kind = "prismatic" if body.joint.kind == "prismatic" else "revolute"
        body = replace(body, joint=Joint(kind, body.joint.axis), mimic=mimic)
    return Link(body, body.name, name, _limits(joint, ignored), damping, friction)


def _mimic(
    joint: ElementTree.Element, joints: dict[str, ElementTree.Element], ignored: Counter[str]
) -> Mimic | None:
    """Return what a joint follows; a fixed joint follows nothing."""
    mimic = joint.find("mimic")
    kind = joint.get("type")
    if mimic is None:
        return None
    if kind == "fixed":
        ignored["<mimic> of fixed joints"] += 1
        return None
    where = f"{where_of(joint)} mimic"
    name = mimic.get("joint", "")
    leader = joints.get(name, ElementTree.Element("joint"))
    child = leader.find("child")
    leads = leader.get("type") in WITH_RANGE and leader.find("mimic") is None
    if kind not in WITH_DYNAMICS or not leads or child is None:
        expected = "a revolute, continuous or prismatic joint that follows a revolute or "
        expected += f"prismatic one, which follows none; {_leaving(joint.get('name'), 'mimic')}"
        raise ArgumentError(where, name, expected)
    multiplier = _number(where, mimic, "multiplier", "1")
    return Mimic(child.get("link", ""), multiplier, _number(where, mimic, "offset", "0"))


def _limits(joint: ElementTree.Element, ignored: Counter[str]) -> tuple[float, float] | None:
    """Return the range of a joint; None if it has none."""
    limit = joint.find("limit")
    kind = joint.get("type")
    if limit is None:
        return None
    if kind not in WITH_RANGE:
        ignored[f"<limit> of {kind} joints"] += 1
        return None
    where = f"{where_of(joint)} limit"
    lower, upper = (_number(where, limit, bound, "0") for bound in ("lower", "upper"))
    if lower > upper:
        leaving = _leaving(joint.get("name"), "limit")
        raise ArgumentError(where, [lower, upper], f"lower < upper; {leaving}")
    if max(-lower, upper) > FARTHEST and min(-lower, upper) > FARTHEST:
        return None
    return max(lower, -FARTHEST), min(upper, FARTHEST)


def _dynamics(joint: ElementTree.Element, name: str, ignored: Counter[str]) -> float:
    """Return damping or friction of a joint."""
    dynamics = joint.find("dynamics")
    kind = joint.get("type")
    if dynamics is None:
        return 0.0
    where = f"{where_of(joint)} dynamics"
    value = _number(where, dynamics, name, "0")
    if value < 0.0:
        raise ArgumentError(f"{where} {name}", value, "a number >= 0")
    if kind in WITH_DYNAMICS or value == 0.0:
        return value
    if kind != "fixed":
        leaving = _leaving(joint.get("name"), "dynamics")
        raise ArgumentError(f"{where} {name}", value, f"none of a {kind} joint; {leaving}")
    ignored["<dynamics> of fixed joints"] += 1
    return 0.0


def _refuse_empty_ranges(links: Iterable[Link]) -> None:
    """Refuse joints that their range locks, for a limit here lets the joint move."""
    empty = [link.joint for link in links if link.limits and link.limits[0] == link.limits[1]]
    if empty:
        leaving = ", ".join(f"{name}: [limit]" for name in empty)
        raise ArgumentError(
            "<limit>",
            empty,
            "lower < upper (both are 0 by default, which locks the joint); "
            f"leave_out: {{{leaving}}} lets it turn without limits",
        )


def _remarks(joints: dict[str, ElementTree.Element], ignored: Counter[str]) -> tuple[str, ...]:
    """Return sentences on what has no limits and on what is ignored."""
    said = []
    unlimited = [
        name
        for name, joint in joints.items()
        if joint.get("type") in WITH_RANGE and joint.find("limit") is None
    ]
    if unlimited:
        said.append(f"without <limit>, so without limits: {', '.join(sorted(unlimited))}")
    if ignored:
        counts = ", ".join(f"{what} ({count})" for what, count in ignored.items())
        shapes = any(f"<{tag}>" in ignored for tag in _SHAPES)
        said.append(f"ignored: {counts}" + "; the scene gives shapes" * shapes)
    return tuple(said)


def _number(where: str, element: ElementTree.Element, name: str, default: str) -> float:
    return float(numbers_in(f"{where} {name}", element.get(name, default), 1)[0])


def _inertial(link: ElementTree.Element) -> tuple[Any, ...]:
    """Return mass, centre of mass and inertia about it, in link axes; nothing if there is no
    <inertial>."""
    inertial = link.find("inertial")
    where = f"{where_of(link)} inertial"
    if inertial is None:
        return ()
    mass = inertial.find("mass")
    tensor = inertial.find("inertia")
    if mass is None or tensor is None:
        raise ArgumentError(where, "incomplete", "a <mass> and an <inertia>")
    rotation, center = origin_of(inertial, where)
    xx, xy, xz, yy, yz, zz = (
        numbers_in(f"{where} inertia {key}", tensor.get(key), 1)[0]
        for key in _ATTRIBUTES["inertia"]
    )
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turned = turned_inertia(rotation, matrix)
    return numbers_in(f"{where} mass", mass.get("value"), 1)[0], center, 0.5 * (turned + turned.T)


def _joint(element: ElementTree.Element) -> Joint:
    where = where_of(element)
    kind = element.get("type", "")
    axis = element.find("axis")
    if kind not in KIND_OF_TYPE:
        leaving = _leaving(element.get("name"), "joint")
        raise ArgumentError(f"{where} type", kind, f"{one_of(kind, KIND_OF_TYPE)}; {leaving}")
    along = np.array((1.0, 0.0, 0.0))  # default of the specification
    if kind in WITH_AXIS and axis is not None:
        along = numbers_in(f"{where} axis", axis.get("xyz"), 3)
        if not along.any():
            raise ArgumentError(f"{where} axis", axis.get("xyz"), "a vector that is not zero")
    x, y, z = along.tolist()
    return Joint(KIND_OF_TYPE[kind], (x, y, z))


class _Builder(ElementTree.TreeBuilder):
    """Builds the elements of a file, but refuses entities, which a malicious one could contain."""

    def doctype(self, *_: object) -> NoReturn:
        raise ArgumentError(
            "URDF file", "<!DOCTYPE", "no <!DOCTYPE>: its entities can expand without limit"
        )


def parse_robot(path: Path) -> tuple[ElementTree.Element, Counter[str]]:
    """Return the robot element of a URDF file, and how often it has what is not read; an
    ArgumentError says what is wrong with the file."""
    text = bytes_of(path, MAX_BYTES + 1, "a readable URDF file")
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
    ignored: Counter[str] = Counter()
    _check_spelling(robot, "<robot>", ignored)
    return robot, ignored


def _check_spelling(element: ElementTree.Element, where: str, ignored: Counter[str]) -> None:
    """Raise ArgumentError for misspelt or repeated elements and misspelt attributes of what is
    read; count the others.

    Elements of other tools (<gazebo>, <transmission>, <contact> …) are allowed, as the format
    intends. A name that nearly equals an element that is read counts as an error: otherwise a link
    could lose its mass without a message.
    """
    read, attributes = (table.get(str(element.tag), ()) for table in (_CHILDREN, _ATTRIBUTES))
    for name, value in element.attrib.items():
        if name in attributes:
            continue
        if difflib.get_close_matches(name, attributes, n=1, cutoff=_NEAR_ATTRIBUTE):
            raise ArgumentError(
                f"{where} {name}", value, one_of(name, attributes, "one of its attributes: ")
            )
        ignored[f"{name} of <{element.tag}>"] += 1
    seen: set[str] = set()
    for child in element:
        tag = str(child.tag)
        if tag in seen and tag not in _MANY:
            raise ArgumentError(f"{where} <{tag}>", "given twice", "one of them")
        if tag in read:
            seen.add(tag)
            inside = where_of(child) if element.tag == "robot" else f"{where} {tag}"
            _check_spelling(child, inside, ignored)
        elif near := difflib.get_close_matches(tag, read, n=1, cutoff=_NEAR):
            raise ArgumentError(
                f"{where} <{tag}>", tag, f"<{near[0]}>; is it misspelt? Rename it if not"
            )
        else:
            ignored[f"<{tag}>"] += 1


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
        raise ArgumentError(where, text, counted(count, "finite number"))
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
