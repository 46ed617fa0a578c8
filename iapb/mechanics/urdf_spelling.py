"""Slips in a URDF file that would otherwise pass for absent: a misspelt element, an unknown attribute, one given twice.

Elements of others (<gazebo>, <transmission>, <contact> …) are let through, as the format intends; one that is spelt
nearly like an element that is read is taken for a slip, since the alternative is a link without mass and no word said.
"""

from __future__ import annotations

import difflib
import xml.etree.ElementTree as ElementTree

from iapb.errors import ArgumentError
from iapb.names import one_of

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
_MANY = ("link", "joint", "collision")  # of these an element may hold several
_NEAR = 0.75  # share of letters that agree: inertail and colision are slips, contact is a word of its own


def check_spelling(robot: ElementTree.Element) -> None:
    """Raise ArgumentError for the first slip in the parts of a robot that are read."""
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
            raise ArgumentError(f"{where} <{tag}>", tag, f"<{near[0]}>, or a name less like it")
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
        if name not in known and not name.startswith("{"):  # another XML namespace: somebody else's
            raise ArgumentError(f"{where} {name}", value, one_of(name, known, "one of its attributes: "))
