"""Detection at the public border: the contacts of a configuration, for laws written in Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.contact.geometry import ContactBuffer, Integers, Shapes
from iapb.contact.kernels.narrow_phase import detect
from iapb.errors import ArgumentError

Floats = NDArray[np.float64]


def detect_contacts(
    shapes: Shapes, pairs: Integers, placements: tuple[Floats, Floats], margin: float, buffer: ContactBuffer
) -> int:
    """Write the contacts with gap <= `margin` [m] into `buffer`; return how many.

    `placements` are the axes R (nb, 3, 3) and origins p (nb, 3) of all bodies, as `Mechanism.placements` gives.

    Raises
    ------
    ArgumentError
        The buffer is too small (`contact_capacity` says how large it must be), or the margin is not a number.
    """
    if np.isnan(margin):
        raise ArgumentError("margin", margin, "a distance in metres, infinity allowed")
    count = int(detect(shapes, pairs, placements[0], placements[1], float(margin), buffer))
    if count < 0:
        raise ArgumentError(
            "buffer", len(buffer.gap), "a capacity of at least contact_capacity(shapes, pairs)"
        )
    return count
