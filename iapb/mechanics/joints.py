"""Joint kinds: how many coordinates and velocities each has, what they mean, and their units.

Layouts follow Pinocchio where the configuration is a manifold: continuous (cos, sin); quaternions x, y, z, w;
free flyer and `planar_se2` velocities in body axes, linear part first. The engine's own `planar` joint is a
chain x-prismatic, y-prismatic, z-revolute with v = dq/dt in the axes of the joint frame, so that a free
planar body has a constant mass matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.names import one_of

# Codes of the kinds in the kernels.
FIXED, REVOLUTE, CONTINUOUS, PRISMATIC, PLANAR, PLANAR_SE2, SPHERICAL, FREE_FLYER = range(8)


@dataclass(frozen=True)
class JointKind:
    """One kind of joint: its code in the kernels and the layout of its coordinates."""

    name: str
    code: int
    coordinates: tuple[tuple[str, str], ...]  # (suffix, unit) of each entry of q
    velocities: tuple[str, ...]  # suffix of each entry of v
    velocity_units: tuple[str, ...]  # unit of each entry of v
    neutral: tuple[float, ...]  # q of the joint at rest
    rotating: tuple[bool, ...]  # for each entry of v: rotation (True) or translation along its axis

    @property
    def nq(self) -> int:
        """Number of configuration entries."""
        return len(self.neutral)

    @property
    def nv(self) -> int:
        """Number of velocity entries."""
        return len(self.rotating)


_TURN = (("angle", "rad"),)
_SLIDE = (("position", "m"),)
_UNIT_CIRCLE = (("cos", "1"), ("sin", "1"))
_PLACE_2D = (("x", "m"), ("y", "m"))
_PLACE_3D = (*_PLACE_2D, ("z", "m"))
_QUATERNION = (("qx", "1"), ("qy", "1"), ("qz", "1"), ("qw", "1"))
_TURNS_3D = ("rx", "ry", "rz")
_METRES, _RADIANS = ("m/s",), ("rad/s",)

KINDS: dict[str, JointKind] = {
    kind.name: kind
    for kind in (
        JointKind("fixed", FIXED, (), (), (), (), ()),
        JointKind("revolute", REVOLUTE, _TURN, ("angle",), _RADIANS, (0.0,), (True,)),
        JointKind("continuous", CONTINUOUS, _UNIT_CIRCLE, ("angle",), _RADIANS, (1.0, 0.0), (True,)),
        JointKind("prismatic", PRISMATIC, _SLIDE, ("position",), _METRES, (0.0,), (False,)),
        JointKind(
            "planar",
            PLANAR,
            (*_PLACE_2D, ("theta", "rad")),
            ("x", "y", "theta"),
            _METRES * 2 + _RADIANS,
            (0.0,) * 3,
            (False, False, True),
        ),
        JointKind(
            "planar_se2",
            PLANAR_SE2,
            _PLACE_2D + _UNIT_CIRCLE,
            ("x", "y", "theta"),
            _METRES * 2 + _RADIANS,
            (0.0, 0.0, 1.0, 0.0),
            (False, False, True),
        ),
        JointKind(
            "spherical", SPHERICAL, _QUATERNION, _TURNS_3D, _RADIANS * 3, (0.0, 0.0, 0.0, 1.0), (True,) * 3
        ),
        JointKind(
            "free_flyer",
            FREE_FLYER,
            _PLACE_3D + _QUATERNION,
            ("x", "y", "z", *_TURNS_3D),
            _METRES * 3 + _RADIANS * 3,
            (0.0,) * 6 + (1.0,),
            (False,) * 3 + (True,) * 3,
        ),
    )
}


@dataclass(frozen=True)
class Joint:
    """The joint that carries a body.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    axis : 3-vector
        Direction of a revolute, continuous or prismatic joint in the joint frame; any length but zero.
        Other kinds ignore it; planar joints move in the x-y plane of the joint frame and turn about its z axis.
    """

    kind: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ArgumentError("kind", self.kind, one_of(self.kind, KINDS))
        axis = np.asarray(self.axis, dtype=np.float64)
        if axis.shape != (3,) or not np.isfinite(axis).all() or not np.any(axis):
            raise ArgumentError("axis", self.axis, "three finite numbers, not all zero")

    @property
    def layout(self) -> JointKind:
        """The kind's entry in `KINDS`."""
        return KINDS[self.kind]

    @property
    def unit_axis(self) -> NDArray[np.float64]:
        """The axis with length one; scaled first, so that tiny axes do not vanish and huge axes do not overflow."""
        axis = np.asarray(self.axis, dtype=np.float64)
        axis = axis / np.abs(axis).max()
        return axis / math.sqrt(sum(x * x for x in axis.tolist()))
