"""Joint kinds: how many coordinates and velocities each has, what they mean, and their units.

Layouts follow Pinocchio where the configuration is a manifold: continuous (cos, sin); quaternions
x, y, z, w; free flyer velocities in body axes, linear part first. The engine's own `planar` joint
is a chain x-prismatic, y-prismatic, z-revolute with v = dq/dt in the axes of the joint frame, so
that a free planar body has a constant mass matrix.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from iapb.mechanics.rotations import unit
from iapb.names import one_of

# Codes of the kinds in the kernels.
FIXED, REVOLUTE, CONTINUOUS, PRISMATIC, PLANAR, SPHERICAL, FREE_FLYER = range(7)


@dataclass(frozen=True)
class JointKind:
    """One kind of joint: its code in the kernels and the layout of its coordinates."""

    name: str
    code: int
    coordinates: tuple[str, ...]  # suffix of each entry of q
    coordinate_units: tuple[str, ...]  # m, rad, or 1 for cosines, sines and quaternions
    velocities: tuple[str, ...]  # suffix of each entry of v
    neutral: tuple[float, ...]  # q of the joint at rest

    @property
    def nq(self) -> int:
        """Number of configuration entries."""
        return len(self.neutral)

    @property
    def nv(self) -> int:
        """Number of velocity entries."""
        return len(self.velocities)

    @property
    def rotating(self) -> tuple[bool, ...]:
        """For each entry of v: rotation about its axis (True) or translation along it."""
        return tuple(suffix not in ("x", "y", "z", "position") for suffix in self.velocities)


KINDS: dict[str, JointKind] = {
    name: JointKind(name, code, tuple(q.split()), tuple(units.split()), tuple(v.split()), neutral)
    for name, code, q, units, v, neutral in (
        ("fixed", FIXED, "", "", "", ()),
        ("revolute", REVOLUTE, "angle", "rad", "angle", (0.0,)),
        ("continuous", CONTINUOUS, "cos sin", "1 1", "angle", (1.0, 0.0)),
        ("prismatic", PRISMATIC, "position", "m", "position", (0.0,)),
        ("planar", PLANAR, "x y theta", "m m rad", "x y theta", (0.0,) * 3),
        ("spherical", SPHERICAL, "qx qy qz qw", "1 1 1 1", "rx ry rz", (0.0, 0.0, 0.0, 1.0)),
        (
            "free_flyer",
            FREE_FLYER,
            "x y z qx qy qz qw",
            "m m m 1 1 1 1",
            "x y z rx ry rz",
            (0.0,) * 6 + (1.0,),
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
        Direction of a revolute, continuous or prismatic joint in the joint frame; any length but
        zero. Other kinds ignore it; planar joints move in the x-y plane of the joint frame and turn
        about its z axis.
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
        """The axis with length one."""
        return unit(self.axis)


class Mimic(NamedTuple):
    """A revolute or prismatic joint without a coordinate of its own: its position follows one."""

    body: str  # the body whose joint it follows, revolute or prismatic
    multiplier: float = 1.0  # of its position, [rad/m, m/rad] between unlike joints
    offset: float = 0.0  # [m, rad]


Range = tuple[float, float]


def ranges_of(joints: Iterable[tuple[str, Range | None, Any]]) -> dict[str, Range | None]:
    """Return the limits of each joint's own coordinate, within those of the joints that follow it.

    A joint is the name of its body, its limits, and None or what it follows, a `Mimic`.
    """
    listed = list(joints)
    found = {name: limits for name, limits, mimic in listed if mimic is None}
    for _, limits, mimic in listed:
        if mimic is not None and limits is not None and mimic.multiplier != 0.0:
            low, high = sorted((bound - mimic.offset) / mimic.multiplier for bound in limits)
            own = found.get(mimic.body) or (low, high)
            found[mimic.body] = max(low, own[0]), min(high, own[1])
    return found
