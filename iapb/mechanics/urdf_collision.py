"""The <collision> elements of a URDF file: which shapes each link touches with, in link axes.

All five geometries of the format are read; which of them a scene can hold is the scene's to say.
Source of the format: the URDF XML specification (wiki.ros.org/urdf/XML/link); <capsule> as in ROS 2.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.urdf_elements import elements_by_name, numbers_in, origin_of, parse_robot, where_of
from iapb.names import one_of

Floats = NDArray[np.float64]

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
