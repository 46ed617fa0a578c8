"""Rigid-body dynamics by Pinocchio, for the rigid worlds and for comparison with the engine.

A Pinocchio model is made from a Mechanism (`model_of`) or, independently of the engine's reader, from a URDF file by
Pinocchio's own parser (`model_from_urdf`). `PinocchioMechanism` uses the engine's conventions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError, MissingDependencyError
from iapb.mechanics.mechanism import Body, Mechanism

Floats = NDArray[np.float64]

# Joints whose coordinates are not the integrals of their velocities, by Pinocchio's class.
_CONTINUOUS, _PLANAR, _SPHERICAL, _FREE_FLYER = range(4)
_TURNING = {"JointModelRUBZ": _CONTINUOUS, "JointModelPlanar": _PLANAR, "JointModelSpherical": _SPHERICAL,
            "JointModelFreeFlyer": _FREE_FLYER}  # fmt: skip
# A bias below this share of M |v|² in a few motions is rounding error: it is zero in every motion.
_NO_BIAS, _MOTIONS = 1e-12, 4


def _pinocchio() -> ModuleType:
    try:
        import pinocchio
    except ImportError as error:
        raise MissingDependencyError("pinocchio", "The rigid-body reference", "pip install pin") from error
    return pinocchio


class PinocchioMechanism:
    """A Pinocchio model with the engine's interface (same q, v, shapes, units and axes as `Mechanism`).

    Parameters
    ----------
    model : pinocchio.Model
        It has one body frame per body, with the body's name.
    """

    def __init__(self, model: Any) -> None:
        self.model, self.data = model, model.createData()
        self.nq, self.nv = int(model.nq), int(model.nv)
        self._bodies: list[int] | None = None  # frames of the bodies, in the mechanism's order
        self._below = np.tril_indices(self.nv, -1)

    def mass_matrix(self, q: Floats) -> Floats:
        """Return M(q) (d, d) by the composite rigid body algorithm, which fills the upper triangle."""
        mass = np.array(_pinocchio().crba(self.model, self.data, q))
        mass[self._below] = mass.T[self._below]
        return mass

    def bias(self, q: Floats, v: Floats) -> Floats:
        """Return B(q, v) (d,) without gravity."""
        return self._under((0.0, 0.0, 0.0), q, v, np.zeros(self.nv))

    def gravity(self, q: Floats, g: ArrayLike) -> Floats:
        """Return G(q) (d,) for the gravity field g (3,) [m/s^2]."""
        return self._under(g, q, np.zeros(self.nv), np.zeros(self.nv))

    def inverse_dynamics(self, q: Floats, v: Floats, dv: Floats, g: ArrayLike) -> Floats:
        """Return tau = M dv + B + G (d,)."""
        return self._under(g, q, v, dv)

    def _under(self, g: ArrayLike, q: Floats, v: Floats, dv: Floats) -> Floats:
        self.model.gravity.linear = np.array(g, dtype=np.float64)
        return np.array(_pinocchio().rnea(self.model, self.data, q, v, dv))

    def frame_jacobian(self, q: Floats, body: str) -> Floats:
        """Return J (6, d) of the body's linear velocity at its origin and angular velocity, in world axes."""
        pinocchio = _pinocchio()
        jacobian = pinocchio.computeFrameJacobian(
            self.model, self.data, q, self._frame(body), pinocchio.LOCAL_WORLD_ALIGNED
        )
        return np.array(jacobian).reshape(6, self.nv)  # one column comes as a vector

    def point_jacobian(self, q: Floats, body: str, point: Floats) -> Floats:
        """Return J (3, d) of a world point fixed to the body: v_origin + omega x (point - origin)."""
        jacobian = self.frame_jacobian(q, body)
        x, y, z = point - self.placement(q, body)[1]
        across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return jacobian[:3] - across @ jacobian[3:]

    def placement(self, q: Floats, body: str) -> tuple[Floats, Floats]:
        """Return axes (3, 3) and origin (3,) [m] of a body in the world."""
        _pinocchio().framesForwardKinematics(self.model, self.data, q)
        frame = self.data.oMf[self._frame(body)]
        return np.array(frame.rotation), np.array(frame.translation)

    def inner_forces(self, q: Floats, v: Floats, g: ArrayLike) -> Floats:
        """Return B + G (d,)."""
        return self._under(g, q, v, np.zeros(self.nv))

    def bodies(self, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Return axes (n + 1, 3, 3), origins (n + 1, 3), Jacobians (n + 1, 6, d) of n bodies and, last, the world."""
        pinocchio, frames = _pinocchio(), self.model.frames
        pinocchio.computeJointJacobians(self.model, self.data, q)
        pinocchio.updateFramePlacements(self.model, self.data)
        if self._bodies is None:
            body = pinocchio.FrameType.BODY
            self._bodies = [k for k in range(1, len(frames)) if frames[k].type == body]
        n = len(self._bodies)
        axes, origins, rows = np.zeros((n + 1, 3, 3)), np.zeros((n + 1, 3)), np.zeros((n + 1, 6, self.nv))
        axes[n] = np.eye(3)
        for b, frame in enumerate(self._bodies):
            placed = self.data.oMf[frame]
            axes[b], origins[b] = placed.rotation, placed.translation
            rows[b] = pinocchio.getFrameJacobian(
                self.model, self.data, frame, pinocchio.LOCAL_WORLD_ALIGNED
            ).reshape(6, self.nv)
        return axes, origins, rows

    def kinetic_energy(self, q: Floats, v: Floats) -> float:
        """Return the kinetic energy [J]."""
        return float(_pinocchio().computeKineticEnergy(self.model, self.data, q, v))

    def potential_energy(self, q: Floats, g: ArrayLike) -> float:
        """Return the potential energy [J] of the bodies that can move."""
        self.model.gravity.linear = np.array(g, dtype=np.float64)
        return float(_pinocchio().computePotentialEnergy(self.model, self.data, q))

    def centroidal_momentum(self, q: Floats, v: Floats) -> Floats:
        """Return momentum and angular momentum about the centre of mass (6,) [N s, N m s]."""
        return np.array(_pinocchio().computeCentroidalMomentum(self.model, self.data, q, v).vector)

    def integrate(self, q: Floats, v: Floats, dt: float) -> Floats:
        """Return the configuration (nq,) after dt [s] with constant v."""
        return np.array(_pinocchio().integrate(self.model, q, v * dt))

    def difference(self, q0: Floats, q1: Floats) -> Floats:
        """Return the velocity (d,) that leads from q0 to q1 in unit time."""
        return np.array(_pinocchio().difference(self.model, q0, q1))

    def normalize(self, q: Floats) -> Floats:
        """Return q (nq,) with its quaternions and (cos, sin) scaled to length one."""
        return np.array(_pinocchio().normalize(self.model, q))

    def rate(self, q: Floats, v: Floats) -> Floats:
        """Return dq/dt (nq,) of a motion with velocity v (d,) through q; this is v itself if nq = d."""
        return v if self.nq == self.nv else np.asarray(_rates(self._layout, q, v))

    @cached_property
    def _layout(self) -> NDArray[np.int64]:
        """Class (-1: dq/dt = v), first coordinate and first velocity (n, 3) of the joints, and a last row of ends."""
        joints = list(self.model.joints)[1:]
        rows = [(_TURNING.get(joint.shortname(), -1), joint.idx_q, joint.idx_v) for joint in joints]
        return np.array([*rows, (-1, self.nq, self.nv)], np.int64)

    def free_acceleration(self, q: Floats, v: Floats) -> Floats:
        """Return dv/dt = −M⁻¹ B (d,) of the motion without forces, by the articulated body algorithm."""
        self.model.gravity.linear = np.zeros(3)
        return np.array(_pinocchio().aba(self.model, self.data, q, v, np.zeros(self.nv)))

    @cached_property
    def has_bias(self) -> bool:
        """Whether B(q, v) differs from zero in some motion, tried in a few random ones. Without, v stays constant."""
        rng = np.random.default_rng(0)
        for _ in range(_MOTIONS):
            v = rng.normal(size=self.nv)
            q = self.integrate(_pinocchio().neutral(self.model), rng.normal(size=self.nv), 1.0)
            scale = np.abs(self.mass_matrix(q)).sum(axis=1) * (v @ v)
            if (np.abs(self.bias(q, v)) > _NO_BIAS * scale).any():
                return True
        return False

    def impulse_dynamics(self, q: Floats, v: Floats, contact_jacobian: Floats, restitution: float) -> Floats:
        """Return v after the impact (d,) by Pinocchio's `impulseDynamics`; rows must be independent."""
        run = _pinocchio().impulseDynamics
        return np.array(run(self.model, self.data, q, v, contact_jacobian, restitution, 0.0))

    def calls(self) -> tuple[Callable[[Floats], Floats], Callable[[Floats, Floats], Floats]]:
        """Return Pinocchio's functions q -> M and (q, v) -> B + G, bound to the model, for timing."""
        pinocchio = _pinocchio()
        return (
            partial(pinocchio.crba, self.model, self.data),
            partial(pinocchio.nonLinearEffects, self.model, self.data),
        )

    def _frame(self, body: str) -> int:
        body_type = _pinocchio().FrameType.BODY
        if not self.model.existFrame(body, body_type):
            raise ArgumentError("body", body, "the name of a body of the model")
        return int(self.model.getFrameId(body, body_type))


@numba.njit(cache=True, fastmath=False)
def _rates(layout, q, v):  # type: ignore[no-untyped-def]
    """Return dq/dt (nq,) from velocities in body axes: R v of a position, ½ r ⊗ ω of a quaternion r = (x, y, z, w)."""
    rate = np.empty(len(q))
    for j in range(len(layout) - 1):
        kind, a, b = layout[j]
        if kind in (_CONTINUOUS, _PLANAR):
            if kind == _PLANAR:
                cos, sin = q[a + 2], q[a + 3]
                rate[a], rate[a + 1] = cos * v[b] - sin * v[b + 1], sin * v[b] + cos * v[b + 1]
                a, b = a + 2, b + 2
            rate[a], rate[a + 1] = -q[a + 1] * v[b], q[a] * v[b]
        elif kind in (_SPHERICAL, _FREE_FLYER):
            if kind == _FREE_FLYER:
                r, w, u = q[a + 3 : a + 6], q[a + 6], v[b : b + 3]
                rate[a : a + 3] = u + 2.0 * np.cross(r, np.cross(r, u) + w * u)
                a, b = a + 3, b + 3
            r, w, turn = q[a : a + 3], q[a + 3], v[b : b + 3]
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
    return PinocchioMechanism(pinocchio.buildModelFromUrdf(str(path), *root))


def model_of(mechanism: Mechanism) -> PinocchioMechanism:
    """Build the same mechanism in Pinocchio.

    A fixed body becomes a frame, and its inertia is added to its parent body. A planar joint becomes three joints.

    Raises
    ------
    ArgumentError
        The bodies are not in depth-first order, for which Pinocchio would silently give wrong results.
    """
    _check_depth_first(mechanism)
    pinocchio = _pinocchio()
    model = pinocchio.Model()
    anchors: dict[str | None, tuple[int, Any]] = {None: (0, pinocchio.SE3.Identity())}
    for body in mechanism.bodies:
        joint, offset = anchors[body.parent]
        placement = offset * pinocchio.SE3(*body.placement)
        for step, (part, before) in enumerate(_joint_models(pinocchio, body)):
            joint = model.addJoint(joint, part, placement * before, f"{body.name} joint {step}")
            placement = before.inverse()
        anchors[body.name] = (joint, placement)
        inertia = pinocchio.Inertia(body.mass, body.center_of_mass, body.inertia)
        model.appendBodyToJoint(joint, inertia, placement)
        model.addBodyFrame(body.name, joint, placement, 0)
    return PinocchioMechanism(model)


def _frame_along(axis: Floats) -> Floats:
    """Return a rotation (3, 3) with the given z axis, accurate to rounding for every direction."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(axis, x), axis))


def _check_depth_first(mechanism: Mechanism) -> None:
    """Check that each body's parent is the body before it or one of that body's ancestors."""
    open_chain: list[str] = []
    for body in mechanism.bodies:
        while open_chain and open_chain[-1] != body.parent:
            open_chain.pop()
        if body.parent is not None and not open_chain:
            raise ArgumentError("mechanism", body.name, "bodies in depth-first order")
        open_chain.append(body.name)


def _joint_models(pinocchio: ModuleType, body: Body) -> list[tuple[Any, Any]]:
    """Return the chain of Pinocchio joints that forms the body's joint, each with a rotation before it.

    The rotation is undone after the joint. It is needed because Pinocchio's unbounded joint always rotates about z.
    """
    kind, axis, straight = body.joint.kind, body.joint.unit_axis, pinocchio.SE3.Identity()
    if kind == "fixed":
        return []
    if kind == "planar":
        chain = (pinocchio.JointModelPX, pinocchio.JointModelPY, pinocchio.JointModelRZ)
        return [(part(), straight) for part in chain]
    if kind == "continuous":
        return [(pinocchio.JointModelRUBZ(), pinocchio.SE3(_frame_along(axis), np.zeros(3)))]
    if kind == "revolute":
        return [(pinocchio.JointModelRevoluteUnaligned(axis), straight)]
    if kind == "prismatic":
        return [(pinocchio.JointModelPrismaticUnaligned(axis), straight)]
    whole = {
        "spherical": pinocchio.JointModelSpherical,
        "free_flyer": pinocchio.JointModelFreeFlyer,
    }
    return [(whole[kind](), straight)]


def impulse_dynamics(
    mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike, restitution: float
) -> Floats:
    """Return v after an impact (d,) by Pinocchio's `impulseDynamics` for any mass matrix.

    `impulseDynamics` takes a model, so the model here is a serial chain of d joints whose M is overwritten. It factors
    M, forms the Delassus matrix J M^-1 J^T and factors that. So rows must be independent, and the error grows
    with the square of the condition number of A = J L^-T.

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite
    contact_jacobian : (c, d) independent rows, c >= 1
    velocity : (d,)
    restitution : in [-1, 1]
    """
    pinocchio = _pinocchio()
    mass, rows = np.array(mass_matrix, np.float64), np.array(contact_jacobian, np.float64)
    v = np.array(velocity, np.float64)
    model = pinocchio.Model()
    joint = 0
    for k in range(len(v)):
        joint = model.addJoint(joint, pinocchio.JointModelPX(), pinocchio.SE3.Identity(), f"joint {k}")
    data = model.createData()
    data.M[:, :] = mass
    return np.array(pinocchio.impulseDynamics(model, data, v, rows, restitution, 0.0))
