"""Mechanism: bodies and joints described by one configuration q (paper section IV, equations (1) to
(3)).

M(q) dv/dt + B(q, v) + G(q) = J^T F, for several trees at once: M = blockdiag(M_1 ... M_m).
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from iapb.mechanics import structure
from iapb.mechanics.bodies import Body, finite_array, float_array, parents_and_trees
from iapb.mechanics.joints import Joint
from iapb.mechanics.kernels import configuration, dynamics, evaluation, kinematics
from iapb.mechanics.kernels.arrays import MechanismArrays, make_workspace
from iapb.mechanics.urdf import read_urdf
from iapb.numerics import linalg
from iapb.numerics.compiled import Entry, block
from iapb.numerics.schema import Floats, Integers

__all__ = ["Body", "Joint", "Mechanism"]


_CALLED = (
    configuration.difference,
    configuration.integrate,
    dynamics.gravity,
    dynamics.inverse_dynamics,
    linalg.all_finite,
    linalg.cholesky,
    evaluation.biases_at,
    evaluation.centroidal_momentum,
    evaluation.displacements_along,
    evaluation.energies_along,
    evaluation.mass_matrices_at,
    evaluation.misplaced_body,
    evaluation.poses_along,
    evaluation.rows_along,
    kinematics.forward_kinematics,
    kinematics.frame_jacobian,
)
_KERNELS = SimpleNamespace(**{kernel.__name__: Entry(kernel) for kernel in _CALLED})


ROUNDED = 1e-13  # share of a diagonal entry of M below which a pivot is rounding error
LIGHTEST = 1e-18  # kg, kg m²: the least pivot of M, whose square must not underflow


class _Scratch(threading.local):
    """Scratch memory of the kernels, for all bodies and for the moving parts alone; each thread has
    its own."""

    def __init__(self, bodies: int, parts: int, dofs: int) -> None:
        self.workspace: Any = block(make_workspace(bodies, dofs))
        self.parts: Any = block(make_workspace(parts, dofs))


def _ranges(tree: Integers, count: int) -> list[tuple[int, int]]:
    """Return the range (start, stop) of each tree among entries of which each has a tree."""
    edges = np.searchsorted(tree, np.arange(count + 1)).tolist()
    return list(itertools.pairwise(edges))


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
        Length of q and of v; they differ for continuous, spherical and free-flyer joints.
    coordinate_names, coordinate_units : tuple of str (nq,)
        body.suffix of each entry of q; m, rad, or 1 for cosines, sines and quaternions.
    velocity_names, velocity_units : tuple of str (nv,)
        body.suffix of each entry of v (and of a generalized force), with rx, ry, rz for rotations;
        m/s or rad/s.
    arrays : MechanismArrays
        The bodies as contiguous arrays for the kernels.
    motions : int
        nv, and one for each joint that follows another one.
    tree_of_body, tree_of_coordinate, tree_of_dof : (n,), (nq,) and (nv,) int arrays
    tree_coordinates, tree_dofs : list of (start, stop)
        Range in q and in v of each tree; empty for a tree of fixed bodies.
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
        parents, trees = parents_and_trees(self.bodies)
        self.names: tuple[str, ...] = tuple(body.name for body in self.bodies)
        layouts = [(body.name, body.joint.layout) for body in self.bodies if body.mimic is None]
        self.coordinate_names = tuple(
            f"{name}.{suffix}" for name, kind in layouts for suffix in kind.coordinates
        )
        self.coordinate_units = tuple(unit for _, kind in layouts for unit in kind.coordinate_units)
        self.velocity_names = tuple(
            f"{name}.{suffix}" for name, kind in layouts for suffix in kind.velocities
        )
        self.velocity_units = tuple(
            "rad/s" if turns else "m/s" for _, kind in layouts for turns in kind.rotating
        )
        self.nq = len(self.coordinate_names)
        self.nv = len(self.velocity_names)
        self.arrays: MechanismArrays = structure.collect_arrays(self.bodies, parents)
        self.block: Any = block(self.arrays)
        self.tree_of_body: Integers = np.array(trees, np.int64)
        own = [0 if body.mimic else body.joint.layout.nq for body in self.bodies]
        self.tree_of_coordinate: Integers = np.repeat(self.tree_of_body, own)
        self.tree_of_dof: Integers = self.tree_of_body[self.arrays.dof_body[: self.nv]]
        count = 1 + max(trees, default=-1)
        self.tree_coordinates = _ranges(self.tree_of_coordinate, count)
        self.tree_dofs = _ranges(self.tree_of_dof, count)
        parts = structure.moving_parts(self.arrays)
        self._parts: Any = block(parts)
        self.motions = self.arrays.motions
        self._scratch = _Scratch(len(self.bodies), len(parts.kind), self.motions)
        self._alone: dict[int, Mechanism] = {}
        self.has_constant_mass_matrix: bool = structure.has_constant_mass_matrix(parts)
        self.has_velocity_terms: bool = structure.has_velocity_terms(parts)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the bodies alone: a block holds memory addresses of this process."""
        return Mechanism, (self.bodies,)

    @classmethod
    def from_urdf(cls, path: str | Path, floating_base: bool = False) -> Mechanism:
        """Read a URDF file; see `iapb.mechanics.urdf.read_urdf`."""
        return cls(read_urdf(path, floating_base))

    def index(self, body: int | str) -> int:
        """Return a body's index from its name or index."""
        if isinstance(body, str) and body in self.names:
            return self.names.index(body)
        if isinstance(body, int | np.integer) and 0 <= body < len(self.bodies):
            return int(body)
        raise ArgumentError("body", body, f"a body name or an index below {len(self.bodies)}")

    def alone(self, tree: int) -> Mechanism:
        """Return a mechanism of one tree alone; this is the mechanism itself if it has no other
        tree."""
        if tree not in self._alone:
            bodies = [self.bodies[b] for b in np.flatnonzero(self.tree_of_body == tree)]
            self._alone[tree] = self if len(bodies) == len(self.bodies) else Mechanism(bodies)
        return self._alone[tree]

    def neutral(self) -> Floats:
        """Return the configuration q (nq,) with every joint at its neutral position."""
        places = (b.joint.layout.neutral for b in self.bodies if b.mimic is None)
        return np.array([x for place in places for x in place], dtype=np.float64)

    def integrate(self, q: ArrayLike, v: ArrayLike, dt: float = 1.0) -> Floats:
        """Return q (nq,) moved for dt [s] with the constant velocity v: q + v dt on vector
        coordinates."""
        return self._filled(
            (self.nq,), _KERNELS.integrate, self._place(q), self._rates(v), float(dt)
        )

    def difference(self, q0: ArrayLike, q1: ArrayLike) -> Floats:
        """Return v (d,) with integrate(q0, v, 1) = q1, by the shortest rotations."""
        return self._filled(
            (self.nv,), _KERNELS.difference, self._place(q0, "q0"), self._place(q1, "q1")
        )

    def placements(self, q: ArrayLike) -> tuple[Floats, Floats]:
        """Return (R (n, 3, 3), p (n, 3) [m]): axes and origin of every body in the world."""
        workspace = self._at(q)
        return workspace.rotation.copy(), workspace.position.copy()

    def poses(self, qs: ArrayLike, planar: bool) -> Floats:
        """Return the pose of every body at each of the n configurations qs (n, nq).

        With `planar` the result is (n, bodies, 3): x, y [m] and the angle in (−π, π] [rad].
        Otherwise it is (n, bodies, 7): x, y, z [m] and the quaternion x, y, z, w with w >= 0.
        """
        places = self._places(qs)
        shape = len(places), len(self.bodies), 3 if planar else 7
        return self._filled(shape, _KERNELS.poses_along, self._scratch.workspace, places)

    def mass_matrix(self, q: ArrayLike) -> Floats:
        """Return M(q) (d, d)."""
        return self.mass_matrices(self._place(q)[None])[0]

    def mass_matrices(self, qs: ArrayLike) -> Floats:
        """Return M (n, d, d) at each of the n configurations qs (n, nq), in one compiled call."""
        places = self._places(qs)
        out = np.empty((len(places), self.nv, self.nv))
        if not _KERNELS.mass_matrices_at(self._parts, self._scratch.parts, places, out):
            self._check_states(places)
        return out

    def mass_matrices_of_run(self, start: ArrayLike, qs: ArrayLike) -> Floats:
        """Return M (n, d, d) that a run from `start` (nq,) has at each of its configurations qs.

        The engine computes a constant M once. At another configuration it may differ in the last
        bit, which an exact judgement would see.
        """
        if self.has_constant_mass_matrix:
            return np.repeat(self.mass_matrix(start)[None], len(np.asarray(qs)), axis=0)
        return self.mass_matrices(qs)

    def unmoved_velocity(self, q: ArrayLike) -> int | None:
        """Return the first velocity that moves no mass of its own, so that M(q) is not positive
        definite; None: M is."""
        mass = self.mass_matrix(q)
        lower = np.zeros((self.nv, self.nv))
        _KERNELS.cholesky(mass, lower)
        least = np.maximum(ROUNDED * np.diagonal(mass), LIGHTEST)
        unmoved = np.flatnonzero(np.diagonal(lower) ** 2 < least)
        return int(unmoved[0]) if len(unmoved) else None

    def bias(self, q: ArrayLike, v: ArrayLike) -> Floats:
        """Return B(q, v) (d,), Coriolis and centripetal generalized forces (gravity not
        included)."""
        return self.biases(self._place(q)[None], self._rates(v)[None])[0]

    def biases(self, qs: ArrayLike, vs: ArrayLike) -> Floats:
        """Return B (n, d) at each of the n states qs (n, nq), vs (n, d), in one compiled call."""
        places, rates = self._states(qs, vs)
        out = np.empty(rates.shape)
        if not _KERNELS.biases_at(self._parts, self._scratch.parts, places, rates, out):
            self._check_states(places, rates)
        return out

    def gravity(self, q: ArrayLike, g: ArrayLike) -> Floats:
        """Return G(q) (d,), the gradient of the potential energy, for the field g (3,) [m/s^2]."""
        return self._filled(
            (self.nv,), _KERNELS.gravity, self._at(q), finite_array("g", g, (3,), "m/s^2")
        )

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, dv: ArrayLike, g: ArrayLike) -> Floats:
        """Return tau = M dv + B + G (d,)."""
        given = (
            self._at(q),
            self._rates(v),
            self._rates(dv, "dv"),
            finite_array("g", g, (3,), "m/s^2"),
        )
        return self._filled((self.nv,), _KERNELS.inverse_dynamics, *given)

    def point_jacobian(self, q: ArrayLike, body: int | str, point: ArrayLike) -> Floats:
        """Return J (3, d): velocity, in world axes, of the world point [m] regarded as fixed to the
        body."""
        place = finite_array("point", point, (3,), "m")
        return self._filled(
            (6, self.nv), _KERNELS.frame_jacobian, self._at(q), self.index(body), place
        )[:3]

    def frame_jacobian(self, q: ArrayLike, body: int | str) -> Floats:
        """Return J (6, d): velocity of the body's origin (rows 0-2) and angular velocity (rows
        3-5), in world axes."""
        at = self._at(q)
        b = self.index(body)
        return self._filled((6, self.nv), _KERNELS.frame_jacobian, at, b, at.position[b])

    def rows_along(
        self, qs: ArrayLike, bodies: ArrayLike, points: ArrayLike, directions: ArrayLike
    ) -> Floats:
        """Return directionᵀ J (n, d) of n world points (n, 3): point i is fixed to bodies[i] at
        configuration qs[i].

        Body -1 is the world, which does not move.
        """
        places = self._places(qs)
        fixed_to = np.ascontiguousarray(bodies, np.int64)
        spots = float_array("points", points, (-1, 3))
        along = float_array("directions", directions, (-1, 3))
        if not len(places) == len(fixed_to) == len(spots) == len(along):
            raise ArgumentError(
                "bodies, points and directions", len(spots), f"{len(places)} each, as many as qs"
            )
        if len(fixed_to) and not -1 <= fixed_to.min() <= fixed_to.max() < len(self.names):
            raise ArgumentError("bodies", fixed_to, f"numbers from -1 to {len(self.names) - 1}")
        self._check_states(places)
        given = self._scratch.workspace, places, fixed_to, spots, along
        return self._filled((len(places), self.nv), _KERNELS.rows_along, *given)

    def energies(self, qs: ArrayLike, vs: ArrayLike, g: ArrayLike) -> tuple[Floats, Floats]:
        """Return kinetic and potential energy (n,) [J] at n states, qs (n, nq) and vs (n, d), for
        the field g (3,)."""
        places, rates = self._states(qs, vs)
        field = finite_array("g", g, (3,), "m/s^2")
        kinetic, potential = np.zeros((2, len(places)))
        _KERNELS.energies_along(
            self.block, self._scratch.workspace, places, rates, field, kinetic, potential
        )
        return kinetic, potential

    def kinetic_energy(self, q: ArrayLike, v: ArrayLike) -> float:
        """Return the kinetic energy [J]."""
        return float(self.energies(self._place(q)[None], self._rates(v)[None], np.zeros(3))[0][0])

    def potential_energy(self, q: ArrayLike, g: ArrayLike) -> float:
        """Return -sum m g . c [J] of the bodies that can move, for the field g (3,) [m/s^2]."""
        return float(self.energies(self._place(q)[None], np.zeros((1, self.nv)), g)[1][0])

    def displacements(self, qs: ArrayLike, straight: bool = False) -> Floats:
        """Return the displacement (n, d) [m, rad] of each of the n steps between the n + 1
        configurations qs.

        A free body turns about a screw axis in a step, or, with `straight`, its centre of mass
        moves straight, as the integrator `momentum` moves it.
        """
        places = self._places(qs)
        shape = max(len(places) - 1, 0), self.nv
        return self._filled(shape, _KERNELS.displacements_along, places, bool(straight))

    def centroidal_momentum(self, q: ArrayLike, v: ArrayLike) -> Floats:
        """Return (6,): momentum [N s] and angular momentum [N m s] about the moving bodies' centre
        of mass."""
        return self._filled((6,), _KERNELS.centroidal_momentum, self._at(q), self._rates(v))

    def _at(self, q: ArrayLike) -> Any:
        """Return this thread's scratch with the kinematics of q; the next call overwrites it."""
        workspace = self._scratch.workspace
        _KERNELS.forward_kinematics(self.block, self._place(q), workspace)
        return workspace

    def _filled(self, shape: tuple[int, ...], kernel: Callable[..., None], *given: Any) -> Floats:
        out = np.zeros(shape)
        kernel(self.block, *given, out)
        return out

    def _rates(self, v: ArrayLike, name: str = "v") -> Floats:
        """Return a velocity (nv,) of finite numbers, or raise ArgumentError."""
        rates = float_array(name, v, (self.nv,))
        return rates if _KERNELS.all_finite(rates) else finite_array(name, v, (self.nv,))

    def _place(self, q: ArrayLike, name: str = "q") -> Floats:
        """Return a configuration (nq,) of finite numbers whose quaternions have length one, or
        raise ArgumentError."""
        place = float_array(name, q, (self.nq,))
        b = _KERNELS.misplaced_body(self.block, place)
        if b >= 0:
            finite_array(name, q, (self.nq,))
            first = int(self.arrays.q_start[b])
            units = self.bodies[b].joint.layout.coordinate_units
            of_unit = [first + i for i, unit in enumerate(units) if unit == "1"]
            raise ArgumentError(
                f"{name} of body {self.names[b]!r}", place[of_unit], "entries of total length one"
            )
        return place

    def _places(self, qs: ArrayLike) -> Floats:
        return float_array("qs", qs, (-1, self.nq))

    def _states(self, qs: ArrayLike, vs: ArrayLike) -> tuple[Floats, Floats]:
        """Return as many configurations (n, nq) as velocities (n, d), or raise ArgumentError."""
        places = self._places(qs)
        rates = float_array("vs", vs, (-1, self.nv))
        if len(places) != len(rates):
            raise ArgumentError("vs of shape", rates.shape, f"as many rows as qs, {len(places)}")
        return places, rates

    def _check_states(self, places: Floats, rates: Floats | tuple[()] = ()) -> None:
        for k, q in enumerate(places):
            self._place(q, f"qs[{k}]")
        for k, v in enumerate(rates):
            self._rates(v, f"vs[{k}]")
