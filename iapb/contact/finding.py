"""Contacts of given placements of the bodies, from geometry alone: the narrow phase for Python."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iapb.contact.geometry import ContactBuffer, Shapes
from iapb.contact.kernels.narrow_phase import detect
from iapb.numerics.compiled import Entry, block
from iapb.numerics.schema import Floats, Indices, Integers, zeros_of

FIRST_ROOM = 64  # contacts; the buffer grows when there are more


class Contacts(NamedTuple):
    """c contacts of one configuration.

    The normal is unit and points from b into a; the point lies midway between the surfaces.
    """

    shape_a: Integers  #: (c,)
    shape_b: Integers  #: (c,)
    body_a: Integers  #: (c,)
    body_b: Integers  #: (c,) -1 is the static world
    feature: Integers  #: (c,) which vertex and edge touch
    point: Floats  #: (c, 3) [m]
    normal: Floats  #: (c, 3)
    gap: Floats  #: (c,) [m] negative is overlap


class _Placements(NamedTuple):
    rotation: Floats  # (n, 3, 3)
    position: Floats  # (n, 3)


class ContactFinder:
    """Finds the contacts of candidate pairs of shapes.

    The engine and the references share it: a copy of its rules could not find a wrong rule.
    """

    def __init__(self, shapes: Shapes, pairs: Indices) -> None:
        self._shapes = block(shapes)
        self._pairs = pairs
        self._detect = Entry(detect)
        bodies = 1 + int(shapes.body.max(initial=-1))
        self._placed = block(_Placements(np.empty((bodies, 3, 3)), np.empty((bodies, 3))))
        self._make_room(FIRST_ROOM)

    def _make_room(self, contacts: int) -> None:
        self._found = zeros_of(ContactBuffer, contact=contacts)
        self._buffer = block(self._found)

    def find(self, rotations: Floats, positions: Floats, margin: float = 0.0) -> Contacts:
        """Return the contacts with gap <= `margin` [m].

        Parameters
        ----------
        rotations, positions : (n, 3, 3) and (n, 3), placements of the bodies in the world
        margin : infinity takes the contacts of every pair
        """
        count = 0
        if len(self._pairs):
            self._placed.rotation[:] = rotations[: len(self._placed.rotation)]
            self._placed.position[:] = positions[: len(self._placed.position)]
            given = self._shapes, self._pairs, self._placed, float(margin)
            while (count := int(self._detect(*given, self._buffer))) < 0:
                self._make_room(2 * len(self._found.gap))
        return Contacts(*(getattr(self._found, name)[:count].copy() for name in Contacts._fields))
