"""Rigid-body dynamics by Pinocchio, for the rigid worlds and for comparison with the engine.

A Pinocchio model is made from a Mechanism (`model_of`) or, independently of the engine's reader,
from a URDF file by Pinocchio's own parser (`model_from_urdf`). `PinocchioMechanism` uses the
engine's conventions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError
from iapb.lazy import needed
from iapb.mechanics.mechanism import Mechanism
from reference import Floats

# Joints whose coordinates are not the integrals of their velocities, by Pinocchio's class.
_CONTINUOUS, _SPHERICAL, _FREE_FLYER = range(3)
_TURNING = {
    "JointModelRUBZ": _CONTINUOUS,
    "JointModelSpherical": _SPHERICAL,
    "JointModelFreeFlyer": _FREE_FLYER,
}
# A bias below this share of M |v|² in a few motions is rounding error: it is zero in every motion.
_NO_BIAS = 1e-12
_MOTIONS = 4


_pinocchio = cache(partial(needed, "pinocchio", "The rigid-body reference"))


class PinocchioMechanism:
    """A Pinocchio model with the engine's interface (same q, v, shapes, units and axes as
    `Mechanism`).

    Parameters
    ----------
    model : a pinocchio.Model with one body frame per body, with the body's name, as if all joints
        moved by themselves
    followers : list of (joint, leader, multiplier, offset)
        Joints that follow others, as numbers of joints with one coordinate in the model. The
        model's coordinates are then A q + b, its velocities G v. Pinocchio's own mimic joints lack
        energies, momentum and the articulated body algorithm.
    """

    def __init__(self, model: Any, followers: Sequence[tuple[int, int, float, float]] = ()) -> None:
        self.pin = _pinocchio()
        self.model = model
        self.data = model.createData()
        self._below = np.tril_indices(model.nv, -1)
        spread_q = np.eye(model.nq)
        spread = np.eye(model.nv)
        self._offset = np.zeros(model.nq)
        at = [(model.joints[i], model.joints[k], *rest) for i, k, *rest in followers]
        for joint, leader, multiplier, offset in at:
            spread_q[joint.idx_q, leader.idx_q] = multiplier
            spread[joint.idx_v, leader.idx_v] = multiplier
            self._offset[joint.idx_q] = offset
        self._own = np.delete(np.arange(model.nq), [joint.idx_q for joint, *_ in at])
        self._spread_q = spread_q[:, self._own]
        self._spread = np.delete(spread, [joint.idx_v for joint, *_ in at], axis=1)
        self._follows = bool(at)
        self.nq = len(self._own)
        self.nv = self._spread.shape[1]
        # frames of the bodies, in the mechanism's order; the first frame is the world
        body = self.pin.FrameType.BODY
        self._bodies = [k for k, frame in enumerate(model.frames) if k and frame.type == body]
        self._places = {model.frames[k].name: place for place, k in enumerate(self._bodies)}

    def _at(self, q: Floats) -> Floats:
        """Return all coordinates of the model."""
        return self._spread_q @ q + self._offset if self._follows else q

    def _rates(self, v: Floats) -> Floats:
        """Return all velocities of the model."""
        return self._spread @ v if self._follows else v

    def mass_matrix(self, q: Floats) -> Floats:
        """Return M(q) (d, d) by the composite rigid body algorithm, which fills the upper
        triangle."""
        mass = np.array(self.pin.crba(self.model, self.data, self._at(q)))
        mass[self._below] = mass.T[self._below]
        return self._spread.T @ mass @ self._spread if self._follows else mass

    def bias(self, q: Floats, v: Floats) -> Floats:
        """Return B(q, v) (d,) without gravity."""
        return self.inverse_dynamics(q, v, np.zeros(self.nv), (0.0, 0.0, 0.0))

    def gravity(self, q: Floats, g: ArrayLike) -> Floats:
        """Return G(q) (d,) for the gravity field g (3,) [m/s^2]."""
        return self.inner_forces(q, np.zeros(self.nv), g)

    def inner_forces(self, q: Floats, v: Floats, g: ArrayLike) -> Floats:
        """Return B + G (d,)."""
        return self.inverse_dynamics(q, v, np.zeros(self.nv), g)

    def inverse_dynamics(self, q: Floats, v: Floats, dv: Floats, g: ArrayLike) -> Floats:
        """Return tau = M dv + B + G (d,)."""
        self.model.gravity.linear = np.array(g, dtype=np.float64)
        given = self._at(q), self._rates(v), self._rates(dv)
        forces = np.array(self.pin.rnea(self.model, self.data, *given))
        return self._spread.T @ forces if self._follows else forces

    def bodies(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Return axes (n + 1, 3, 3), origins (n + 1, 3), Jacobians (n + 1, 6, d) of n bodies and,
        last, the world."""
        self.pin.computeJointJacobians(self.model, self.data, self._at(q))
        self.pin.updateFramePlacements(self.model, self.data)
        n = len(self._bodies)
        world = self.pin.LOCAL_WORLD_ALIGNED
        axes = np.zeros((n + 1, 3, 3))
        origins = np.zeros((n + 1, 3))
        rows = np.zeros((n + 1, 6, self.nv))
        axes[n] = np.eye(3)
        for b, frame in enumerate(self._bodies):
            placed = self.data.oMf[frame]
            axes[b] = placed.rotation
            origins[b] = placed.translation
            own = self.pin.getFrameJacobian(self.model, self.data, frame, world)
            rows[b] = own @ self._spread if self._follows else own.reshape(6, self.nv)
        return axes, origins, rows

    def kinetic_energy(self, q: Floats, v: Floats) -> float:
        """Return the kinetic energy [J]."""
        given = self._at(q), self._rates(v)
        return float(self.pin.computeKineticEnergy(self.model, self.data, *given))

    def potential_energy(self, q: Floats, g: ArrayLike) -> float:
        """Return the potential energy [J] of the bodies that can move."""
        self.model.gravity.linear = np.array(g, dtype=np.float64)
        return float(self.pin.computePotentialEnergy(self.model, self.data, self._at(q)))

    def centroidal_momentum(self, q: Floats, v: Floats) -> Floats:
        """Return momentum and angular momentum about the centre of mass (6,) [N s, N m s]."""
        given = self._at(q), self._rates(v)
        return np.array(self.pin.computeCentroidalMomentum(self.model, self.data, *given).vector)

    def integrate(self, q: Floats, v: Floats, dt: float) -> Floats:
        """Return the configuration (nq,) after dt [s] with constant v."""
        return np.array(self.pin.integrate(self.model, self._at(q), self._rates(v) * dt))[self._own]

    def normalize(self, q: Floats) -> Floats:
        """Return q (nq,) with its quaternions and (cos, sin) scaled to length one."""
        return np.array(self.pin.normalize(self.model, self._at(q)))[self._own]

    def rate(self, q: Floats, v: Floats) -> Floats:
        """Return dq/dt (nq,) of a motion with velocity v (d,) through q; this is v itself if nq =
        d."""
        if self.nq == self.nv:
            return v
        rates = _rates(self._layout, self._at(q), self._rates(v))
        return np.asarray(rates)[self._own]

    @cached_property
    def _layout(self) -> NDArray[np.int64]:
        """Class (-1: dq/dt = v), first coordinate and first velocity (n, 3) of the joints, and a
        last row of ends."""
        rows = [
            (_TURNING.get(joint.shortname(), -1), joint.idx_q, joint.idx_v)
            for joint in self.model.joints
        ]
        return np.array([*rows[1:], (-1, self.model.nq, self.model.nv)], np.int64)

    def free_acceleration(self, q: Floats, v: Floats) -> Floats:
        """Return dv/dt = −M⁻¹ B (d,) of the motion without forces, by the articulated body
        algorithm."""
        if self._follows:
            return np.asarray(np.linalg.solve(self.mass_matrix(q), -self.bias(q, v)))
        self.model.gravity.linear = np.zeros(3)
        return np.array(self.pin.aba(self.model, self.data, q, v, np.zeros(self.nv)))

    @cached_property
    def has_bias(self) -> bool:
        """Whether B(q, v) differs from zero in some motion, tried in a few random ones. Without, v
        stays constant."""
        rng = np.random.default_rng(0)
        for _ in range(_MOTIONS):
            v = rng.normal(size=self.nv)
            q = self.integrate(
                self.pin.neutral(self.model)[self._own], rng.normal(size=self.nv), 1.0
            )
            scale = np.abs(self.mass_matrix(q)).sum(axis=1) * (v @ v)
            if (np.abs(self.bias(q, v)) > _NO_BIAS * scale).any():
                return True
        return False

    def index(self, body: str) -> int:
        """Return the place of a body in the arrays of `bodies`."""
        if body not in self._places:
            raise ArgumentError("body", body, "the name of a body of the model")
        return self._places[body]


def at_lever(jacobian: Floats, lever: Floats) -> Floats:
    """Return J (3, d) of a point from the Jacobian (6, d) of its body and its distance (3,) from
    the body's origin."""
    x, y, z = lever
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(jacobian[:3] - across @ jacobian[3:])


@numba.njit(cache=True, fastmath=False)
def _rates(layout, q, v):  # type: ignore[no-untyped-def]
    """Return dq/dt (nq,) from velocities in body axes: R v of a position, ½ r ⊗ ω of a quaternion r
    = (x, y, z, w)."""
    rate = np.empty(len(q))
    for j in range(len(layout) - 1):
        kind, a, b = layout[j]
        if kind == _CONTINUOUS:
            rate[a] = -q[a + 1] * v[b]
            rate[a + 1] = q[a] * v[b]
        elif kind in (_SPHERICAL, _FREE_FLYER):
            if kind == _FREE_FLYER:
                r = q[a + 3 : a + 6]
                w = q[a + 6]
                u = v[b : b + 3]
                rate[a : a + 3] = u + 2.0 * np.cross(r, np.cross(r, u) + w * u)
                a = a + 3
                b = b + 3
            r = q[a : a + 3]
            w = q[a + 3]
            turn = v[b : b + 3]
            rate[a : a + 3] = 0.5 * (w * turn + np.cross(r, turn))
            rate[a + 3] = -0.5 * (r @ turn)
        else:
            count = layout[j + 1, 1] - a
            rate[a : a + count] = v[b : b + count]
    return rate


def model_from_urdf(path: str | Path, floating_base: bool = False) -> PinocchioMechanism:
    """Read a URDF file by Pinocchio's own parser."""
    pinocchio = _pinocchio()
    root = (pinocchio.JointModelFreeFlyer(),) if floating_base else ()
    model = pinocchio.buildModelFromUrdf(str(path), *root)
    read = pinocchio.buildModelFromUrdf(str(path), *root, mimic=True)
    followers = []
    leaders = {joint.idx_q: i for i, joint in enumerate(read.joints) if joint.nq}
    for i, joint in enumerate(read.joints):
        if joint.shortname() == "JointModelMimic":
            follows = joint.extract()
            followers.append((i, leaders[joint.idx_q], follows.scaling, follows.offset))
    return PinocchioMechanism(model, followers)


def calls_from_urdf(
    path: str | Path,
) -> tuple[Callable[[Floats], Floats], Callable[[Floats, Floats], Floats]]:
    """Return Pinocchio's functions q -> M and (q, v) -> B + G, bound to its own model, for
    timing."""
    pinocchio = _pinocchio()
    model = pinocchio.buildModelFromUrdf(str(path), mimic=True)
    data = model.createData()
    return (
        partial(pinocchio.crba, model, data),
        partial(pinocchio.nonLinearEffects, model, data),
    )


def model_of(mechanism: Mechanism) -> PinocchioMechanism:
    """Build the same mechanism in Pinocchio.

    A fixed body becomes a frame, and its inertia is added to its parent body. A planar joint
    becomes three joints.

    Raises
    ------
    ArgumentError
        The bodies are not in depth-first order, for which Pinocchio would silently give wrong
        results.
    """
    # from a root to the newest body
    pinocchio = _pinocchio()
    chain = list[str]()
    model = pinocchio.Model()
    still = pinocchio.SE3.Identity()
    anchors: dict[str | None, tuple[int, Any]] = {None: (0, still)}
    for body in mechanism.bodies:
        while chain and chain[-1] != body.parent:
            chain.pop()
        if body.parent is not None and not chain:
            raise ArgumentError("mechanism", body.name, "bodies in depth-first order")
        chain.append(body.name)
        joint, offset = anchors[body.parent]
        placement = offset * pinocchio.SE3(*body.placement)
        before = still
        kind = body.joint.kind
        axis = body.joint.unit_axis
        # Pinocchio's unbounded joint always rotates about z: turn z to the axis, and back
        if kind == "continuous":
            x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
            x /= np.linalg.norm(x)
            before = pinocchio.SE3(np.column_stack((x, np.cross(axis, x), axis)), np.zeros(3))
        along = (axis,) if kind in ("revolute", "prismatic") else ()
        for step, name in enumerate(_JOINTS[kind]):
            part = getattr(pinocchio, f"JointModel{name}")(*along)
            joint = model.addJoint(joint, part, placement * before, f"{body.name} joint {step}")
            placement = before.inverse()
        anchors[body.name] = (joint, placement)
        inertia = pinocchio.Inertia(body.mass, body.center_of_mass, body.inertia)
        model.appendBodyToJoint(joint, inertia, placement)
        model.addBodyFrame(body.name, joint, placement, 0)
    followers = [
        (
            model.getJointId(f"{body.name} joint 0"),
            model.getJointId(f"{body.mimic.body} joint 0"),
            body.mimic.multiplier,
            body.mimic.offset,
        )
        for body in mechanism.bodies
        if body.mimic is not None
    ]
    return PinocchioMechanism(model, followers)


# Pinocchio's joints that form each joint.
_JOINTS = {
    "fixed": (),
    "planar": ("PX", "PY", "RZ"),
    "continuous": ("RUBZ",),
    "revolute": ("RevoluteUnaligned",),
    "prismatic": ("PrismaticUnaligned",),
    "spherical": ("Spherical",),
    "free_flyer": ("FreeFlyer",),
}


def impulse_dynamics(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: float
) -> Floats:
    """Return v after an impact (d,) by Pinocchio's `impulseDynamics` for any mass matrix.

    `impulseDynamics` takes a model, so the model here is a serial chain of d joints whose M is
    overwritten. It factors M, forms the Delassus matrix J M^-1 J^T and factors that. So rows must
    be independent, and the error grows with the square of the condition number of A = J L^-T.

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite
    contact_jacobian : (c, d) independent rows, c >= 1
    velocity : (d,)
    restitution : in [-1, 1]
    """
    pinocchio = _pinocchio()
    rows = np.array(contact_jacobian, np.float64)
    v = np.array(velocity, np.float64)
    model = pinocchio.Model()
    for k in range(len(v)):
        model.addJoint(k, pinocchio.JointModelPX(), pinocchio.SE3.Identity(), f"joint {k}")
    data = model.createData()
    data.M[:, :] = mass_matrix
    return np.array(pinocchio.impulseDynamics(model, data, v, rows, restitution, 0.0))
