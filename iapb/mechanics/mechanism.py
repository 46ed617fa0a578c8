"""Mechanism: bodies and joints described by one configuration q (paper section IV, equations (1) to (3)).

M(q) dv/dt + B(q, v) + G(q) = J^T F, for several trees at once: M = blockdiag(M_1 ... M_m).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.compiled import Block, Entry, block
from iapb.errors import ArgumentError
from iapb.mechanics import structure
from iapb.mechanics.bodies import Body, finite_array, float_rows, float_vector, parent_indices, tree_indices
from iapb.mechanics.joints import Joint
from iapb.mechanics.kernels import configuration, dynamics, evaluation, kinematics
from iapb.mechanics.kernels.arrays import Evaluation, MechanismArrays, Workspace, make_workspace
from iapb.mechanics.structure import collect_arrays, moving_parts, tree_ranges
from iapb.mechanics.urdf import read_urdf

__all__ = ["Body", "Joint", "Mechanism"]

Floats = NDArray[np.float64]

# The kernels that Python calls, always with a mechanism's blocks and contiguous float arrays (see `Entry`).
entries = SimpleNamespace(**{kernel.__name__: Entry(kernel) for kernel in (
    configuration.difference, configuration.integrate, dynamics.gravity, dynamics.inverse_dynamics,
    evaluation.all_finite, evaluation.bias_at, evaluation.biases_at, evaluation.centroidal_momentum,
    evaluation.displacements_along, evaluation.energies_along, evaluation.impact_loss, evaluation.is_configuration,
    evaluation.kinetic_energy, evaluation.mass_matrices_at, evaluation.mass_matrix_at, evaluation.misplaced_body,
    evaluation.planar_poses_along, evaluation.poses_along, evaluation.potential_energy, evaluation.rows_along,
    kinematics.forward_kinematics, kinematics.frame_jacobian, kinematics.point_jacobian)})  # fmt: skip


class _Scratch(threading.local):
    """Scratch memory of the kernels; each thread has its own.

    Attributes
    ----------
    workspace : for the whole mechanism
    parts : arrays of the moving parts alone, with a workspace of their own
    """

    def __init__(self, workspace: Workspace, parts: MechanismArrays) -> None:
        self.workspace: Block = block(_copied(workspace))
        self.parts: Block = block(Evaluation(parts, _copied(workspace)))


def _copied(workspace: Workspace) -> Workspace:
    return Workspace(*(array.copy() for array in workspace))


class Mechanism:
    """Trees of rigid bodies.

    Parameters
    ----------
    bodies : iterable of Body
        Parents come before children; the bodies of one tree are consecutive.

    Attributes
    ----------
    bodies : tuple of Body
    names : tuple of str
    nq, nv : int
        Length of q and of v; they differ for continuous, spherical, planar_se2 and free-flyer joints.
    coordinate_names, coordinate_units : tuple of str (nq,)
    velocity_names, velocity_units : tuple of str (nv,)
    arrays : MechanismArrays
        The bodies as contiguous arrays for the kernels.
    tree_of_body : (n,) int array
    tree_dofs : list of (start, stop)
        Range in v of each tree; empty for a tree of fixed bodies.
    has_constant_mass_matrix, has_velocity_terms : bool
        See `iapb.mechanics.structure`.
    block : `arrays` in the memory layout of the kernels, built once

    Raises
    ------
    ArgumentError
        Names, parents or order that do not form trees.
    """

    def __init__(self, bodies: Iterable[Body]) -> None:
        self.bodies: tuple[Body, ...] = tuple(bodies)
        parents = parent_indices(self.bodies)
        self.names: tuple[str, ...] = tuple(body.name for body in self.bodies)
        self.arrays: MechanismArrays = collect_arrays(self.bodies, parents)
        self.block: Any = block(self.arrays)
        self.nq: int = sum(body.joint.layout.nq for body in self.bodies)
        self.nv: int = int(self.arrays.v_count.sum())
        self._square = (self.nv, self.nv)
        self._scratch = _Scratch(self.workspace(), moving_parts(self.arrays))
        self._alone: dict[int, Mechanism] = {}
        self.tree_of_body: NDArray[np.int64] = np.array(tree_indices(parents), dtype=np.int64)
        self.tree_dofs: list[tuple[int, int]] = tree_ranges(self.arrays, self.tree_of_body)
        self.has_constant_mass_matrix: bool = structure.has_constant_mass_matrix(self.arrays)
        self.has_velocity_terms: bool = structure.has_velocity_terms(self.arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the bodies alone: a block holds memory addresses of this process."""
        return Mechanism, (self.bodies,)

    @classmethod
    def from_urdf(cls, path: str | Path, floating_base: bool = False) -> Mechanism:
        """Read a URDF file; see `iapb.mechanics.urdf.read_urdf`."""
        return cls(read_urdf(path, floating_base))

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Name of each entry of q: body.suffix."""
        return tuple(f"{b.name}.{suffix}" for b in self.bodies for suffix, _ in b.joint.layout.coordinates)

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """Unit of each entry of q: m, rad, or 1 for cosines, sines and quaternions."""
        return tuple(unit for b in self.bodies for _, unit in b.joint.layout.coordinates)

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """Name of each entry of v (and of a generalized force): body.suffix; rotations about x, y, z are rx, ry, rz."""
        return tuple(f"{b.name}.{suffix}" for b in self.bodies for suffix in b.joint.layout.velocities)

    @property
    def velocity_units(self) -> tuple[str, ...]:
        """Unit of each entry of v: m/s or rad/s."""
        return tuple(unit for b in self.bodies for unit in b.joint.layout.velocity_units)

    def index(self, body: int | str) -> int:
        """Return a body's index from its name or index."""
        if isinstance(body, str) and body in self.names:
            return self.names.index(body)
        if isinstance(body, int | np.integer) and 0 <= body < len(self.bodies):
            return int(body)
        raise ArgumentError("body", body, f"a body name or an index below {len(self.bodies)}")

    def workspace(self) -> Workspace:
        """Return fresh scratch for the kernels."""
        return make_workspace(len(self.bodies), self.nv)

    def alone(self, tree: int) -> Mechanism:
        """Return a mechanism of one tree alone; this is the mechanism itself if it has no other tree."""
        if tree not in self._alone:
            bodies = [self.bodies[b] for b in np.flatnonzero(self.tree_of_body == tree)]
            self._alone[tree] = self if len(bodies) == len(self.bodies) else Mechanism(bodies)
        return self._alone[tree]

    def neutral(self) -> Floats:
        """Return the configuration q (nq,) with every joint at its neutral position."""
        return np.array([x for b in self.bodies for x in b.joint.layout.neutral], dtype=np.float64)

    def integrate(self, q: ArrayLike, v: ArrayLike, dt: float = 1.0) -> Floats:
        """Return q (nq,) moved for dt [s] with the constant velocity v: q + v dt on vector coordinates."""
        out = np.empty(self.nq)
        entries.integrate(self.block, self._configuration(q), self._velocity(v), float(dt), out)
        return out

    def difference(self, q0: ArrayLike, q1: ArrayLike) -> Floats:
        """Return v (d,) with integrate(q0, v, 1) = q1, by the shortest rotations."""
        out = np.empty(self.nv)
        entries.difference(self.block, self._configuration(q0, "q0"), self._configuration(q1, "q1"), out)
        return out

    def placements(self, q: ArrayLike) -> tuple[Floats, Floats]:
        """Return (R (n, 3, 3), p (n, 3) [m]): axes and origin of every body in the world."""
        workspace = self._at(q)
        return workspace.rotation.copy(), workspace.position.copy()

    def poses(self, qs: ArrayLike, planar: bool) -> Floats:
        """Return the pose of every body at each of the n configurations qs (n, nq).

        With `planar` the result is (n, bodies, 3): x, y [m] and the angle in (−π, π] [rad]. Otherwise it is
        (n, bodies, 7): x, y, z [m] and the quaternion x, y, z, w with w >= 0.
        """
        places = float_rows("qs", qs, self.nq)
        out = np.empty((len(places), len(self.bodies), 3 if planar else 7))
        along = entries.planar_poses_along if planar else entries.poses_along
        along(self.block, self._scratch.workspace, places, out)
        return out

    def mass_matrix(self, q: ArrayLike) -> Floats:
        """Return M(q) (d, d)."""
        place, out = float_vector("q", q, self.nq), np.empty(self._square)
        if not self._mass_matrix_at(self._scratch.parts, place, out):
            self._refuse("q", place)
        return out

    def mass_matrices(self, qs: ArrayLike) -> Floats:
        """Return M (n, d, d) at each of the n configurations qs (n, nq), in one compiled call."""
        places = float_rows("qs", qs, self.nq)
        out = np.empty((len(places), self.nv, self.nv))
        done = entries.mass_matrices_at(self._scratch.parts, places, out)
        if done < len(places):
            self._refuse(f"qs[{done}]", places[done])
        return out

    def bias(self, q: ArrayLike, v: ArrayLike) -> Floats:
        """Return B(q, v) (d,), Coriolis and centripetal generalized forces (gravity not included)."""
        place, rates = float_vector("q", q, self.nq), float_vector("v", v, self.nv)
        out = np.empty(self.nv)
        if not self._bias_at(self._scratch.parts, place, rates, out):
            self._refuse("q", place, "v", rates)
        return out

    def biases(self, qs: ArrayLike, vs: ArrayLike) -> Floats:
        """Return B (n, d) at each of the n states qs (n, nq), vs (n, d), in one compiled call."""
        places, rates = float_rows("qs", qs, self.nq), float_rows("vs", vs, self.nv)
        if len(places) != len(rates):
            raise ArgumentError("vs of shape", rates.shape, f"as many rows as qs, {len(places)}")
        out = np.empty((len(places), self.nv))
        done = entries.biases_at(self._scratch.parts, places, rates, out)
        if done < len(places):
            self._refuse(f"qs[{done}]", places[done], f"vs[{done}]", rates[done])
        return out

    def gravity(self, q: ArrayLike, g: ArrayLike) -> Floats:
        """Return G(q) (d,), the gradient of the potential energy, for the field g (3,) [m/s^2]."""
        return self._filled((self.nv,), entries.gravity, self._at(q), _field(g))

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, dv: ArrayLike, g: ArrayLike) -> Floats:
        """Return tau = M dv + B + G (d,)."""
        rates, change = self._velocity(v), self._velocity(dv, "dv")
        return self._filled((self.nv,), entries.inverse_dynamics, self._at(q), rates, change, _field(g))

    def point_jacobian(self, q: ArrayLike, body: int | str, point: ArrayLike) -> Floats:
        """Return J (3, d): velocity, in world axes, of the world point [m] regarded as fixed to the body."""
        place = finite_array("point", point, (3,), "m")
        return self._filled((3, self.nv), entries.point_jacobian, self._at(q), self.index(body), place)

    def rows_along(self, qs: ArrayLike, bodies: ArrayLike, points: ArrayLike, directions: ArrayLike) -> Floats:
        """Return directionᵀ J (n, d) of n world points (n, 3): point i is fixed to bodies[i] at configuration qs[i].

        Body -1 is the world, which does not move.
        """
        places, fixed_to = float_rows("qs", qs, self.nq), np.ascontiguousarray(bodies, np.int64)
        spots, along = float_rows("points", points, 3), float_rows("directions", directions, 3)
        if not len(places) == len(fixed_to) == len(spots) == len(along):
            raise ArgumentError("bodies, points and directions", len(spots), f"{len(places)} each, as many as qs")
        if len(fixed_to) and not -1 <= fixed_to.min() <= fixed_to.max() < len(self.names):
            raise ArgumentError("bodies", fixed_to, f"numbers from -1 to {len(self.names) - 1}")
        out = np.empty((len(places), self.nv))
        done = entries.rows_along(self.block, self._scratch.workspace, places, fixed_to, spots, along, out)
        if done < len(places):
            self._refuse(f"qs[{done}]", places[done])
        return out

    def frame_jacobian(self, q: ArrayLike, body: int | str) -> Floats:
        """Return J (6, d): velocity of the body's origin (rows 0-2) and angular velocity (rows 3-5), in world axes."""
        return self._filled((6, self.nv), entries.frame_jacobian, self._at(q), self.index(body))

    def energies(self, qs: ArrayLike, vs: ArrayLike, g: ArrayLike) -> tuple[Floats, Floats]:
        """Return kinetic and potential energy (n,) [J] at n states, qs (n, nq) and vs (n, d), for the field g (3,)."""
        places, rates = float_rows("qs", qs, self.nq), float_rows("vs", vs, self.nv)
        kinetic, potential = np.zeros(len(places)), np.zeros(len(places))
        entries.energies_along(self.block, self._scratch.workspace, places, rates, _field(g), kinetic, potential)
        return kinetic, potential

    def displacements(self, qs: ArrayLike, straight: bool = False) -> Floats:
        """Return the displacement (n, d) [m, rad] of each of the n steps between the n + 1 configurations qs.

        A free body turns about a screw axis in a step, or, with `straight`, its centre of mass moves straight, as the
        integrator `momentum` moves it.
        """
        places = float_rows("qs", qs, self.nq)
        out = np.zeros((max(len(places) - 1, 0), self.nv))
        entries.displacements_along(self.block, places, bool(straight), out)
        return out

    def kinetic_energy(self, q: ArrayLike, v: ArrayLike) -> float:
        """Return the kinetic energy [J]."""
        return float(entries.kinetic_energy(self.block, self._at(q), self._velocity(v)))

    def potential_energy(self, q: ArrayLike, g: ArrayLike) -> float:
        """Return -sum m g . c [J] of the bodies that can move, for the field g (3,) [m/s^2]."""
        return float(entries.potential_energy(self.block, self._at(q), _field(g)))

    def centroidal_momentum(self, q: ArrayLike, v: ArrayLike) -> Floats:
        """Return (6,): momentum [N s] and angular momentum [N m s] about the moving bodies' centre of mass."""
        return self._filled((6,), entries.centroidal_momentum, self._at(q), self._velocity(v))

    @cached_property
    def _mass_matrix_at(self) -> Callable[..., bool]:
        return entries.mass_matrix_at.taking(self._scratch.parts, np.empty(self.nq), np.empty(self._square))

    @cached_property
    def _bias_at(self) -> Callable[..., bool]:
        v = np.empty(self.nv)
        return entries.bias_at.taking(self._scratch.parts, np.empty(self.nq), v, v)

    def _at(self, q: ArrayLike) -> Block:
        """Return this thread's scratch with the kinematics of q; the next call overwrites it."""
        workspace: Block = self._scratch.workspace
        entries.forward_kinematics(self.block, self._configuration(q), workspace)
        return workspace

    def _filled(self, shape: tuple[int, ...], kernel: Callable[..., None], *given: Any) -> Floats:
        out = np.zeros(shape)
        kernel(self.block, *given, out)
        return out

    def _velocity(self, v: ArrayLike, argument: str = "v") -> Floats:
        values = float_vector(argument, v, self.nv)
        return values if entries.all_finite(values) else finite_array(argument, v, (self.nv,))

    def _configuration(self, q: ArrayLike, argument: str = "q") -> Floats:
        values = float_vector(argument, q, self.nq)
        if not entries.is_configuration(self.block, values):
            self._refuse(argument, values)
        return values

    def _refuse(self, argument: str, q: Floats, rates: str = "v", v: ArrayLike | None = None) -> None:
        """Raise ArgumentError for an invalid configuration or an invalid velocity."""
        finite_array(argument, q, (self.nq,))
        b = entries.misplaced_body(self.block, q)
        if b >= 0:
            first, layout = int(self.arrays.q_start[b]), self.bodies[b].joint.layout
            unit = [first + i for i, (_, u) in enumerate(layout.coordinates) if u == "1"]
            where = f"{argument} of body {self.names[b]!r}"
            raise ArgumentError(where, q[unit], "entries of total length one")
        finite_array(rates, np.zeros(self.nv) if v is None else v, (self.nv,))


def _field(g: ArrayLike) -> Floats:
    return finite_array("g", g, (3,), "m/s^2")
