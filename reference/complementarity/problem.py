"""ImpactProblem: an impact (or one time step) as a complementarity problem over contact impulses.

Frictionless, by Newton's law:  0 <= p ⟂ gamma_plus + E gamma_minus >= 0,  gamma_plus = gamma_minus + W p.
With friction mu and blocks (normal, tangent...):  K ∋ p ⟂ u + mu |u_T| n ∈ K*  (Coulomb's law, an NCP),
where u is gamma_plus with E gamma_minus added to its normals. `relaxed` drops the shift mu |u_T|: the CCP.
A joint is a block with gamma_plus = 0 in all components and p of either sign; the problem is then mixed (MLCP). If a
joint has fewer components than a block, the other rows are zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.errors import ArgumentError, SolverError

Floats = NDArray[np.float64]

# Rounding of n products leaves an asymmetry of n·eps, files with 12 digits 1e-11; above this tolerance the
# matrix itself is asymmetric.
SYMMETRY_TOLERANCE = 1e-9

# A W from single precision or subtraction has eigenvalues down to -1e-7 of the largest. Up to this tolerance the
# nearest semidefinite W is solved instead; residuals still use the given W.
INDEFINITE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class ImpactProblem:
    """A contact problem with n = contacts x contact_size unknown impulses p [N s].

    Attributes
    ----------
    delassus : (n, n) W = J M⁻¹ Jᵀ [1/kg]
    gamma_minus : (n,) contact velocities J v⁻ before the impact [m/s]; normals > 0 separate
    restitution : (k,) Newton's e of each contact, in [0, 1]; it is ignored for joints
    friction : (k,) Coulomb's mu, or None for frictionless contacts (then contact_size is 1)
    contact_size : components per contact, normal first: 1, 2 (planar friction) or 3
    relaxed : True drops the shift mu |u_T| from Coulomb's law (convex relaxation)
    bilateral : (k,) True for blocks of joints, or None
    mass_matrix, contact_jacobian, velocity : the mechanics (d, d), (n, d), (d,), if known
    """

    delassus: Floats
    gamma_minus: Floats
    restitution: Floats
    friction: Floats | None = None
    contact_size: int = 1
    relaxed: bool = False
    name: str = ""
    mass_matrix: Floats | None = None
    contact_jacobian: Floats | None = None
    velocity: Floats | None = None
    bilateral: NDArray[np.bool_] | None = None

    @classmethod
    def from_impact(
        cls,
        mass_matrix: ArrayLike,
        contact_jacobian: ArrayLike,
        velocity: ArrayLike,
        restitution: ArrayLike,
        friction: ArrayLike | None = None,
        *,
        contact_size: int | None = None,
        relaxed: bool = False,
        bilateral: ArrayLike | None = None,
        name: str = "",
    ) -> ImpactProblem:
        """Return the problem of an impact of velocity v (d,) on rows J (n, d) with mass matrix M (d, d)."""
        mass = _finite("mass_matrix", mass_matrix, 2)
        jacobian = _finite("contact_jacobian", contact_jacobian, 2)
        v = _finite("velocity", velocity, 1)
        _check_shapes(mass, jacobian, v)
        size = contact_size or (1 if friction is None else 3)
        factor = _mechanical_factor(mass, jacobian)
        coefficients = _per_contact("restitution", restitution, len(jacobian), size)
        mu = None if friction is None else _per_contact("friction", friction, len(jacobian), size)
        gamma, w = jacobian @ v, factor @ factor.T
        joints = _joints(bilateral, len(coefficients))
        return cls(w, gamma, coefficients, mu, size, relaxed, name, mass, jacobian, v, joints)

    @classmethod
    def from_delassus(
        cls,
        delassus: ArrayLike,
        gamma_minus: ArrayLike,
        restitution: ArrayLike = 0.0,
        friction: ArrayLike | None = None,
        *,
        contact_size: int | None = None,
        relaxed: bool = False,
        bilateral: ArrayLike | None = None,
        name: str = "",
    ) -> ImpactProblem:
        """Return the problem of W (n, n) and gamma_minus (n,); with e = 0 it is the LCP (W, gamma_minus)."""
        w = _finite("delassus", delassus, 2)
        gamma = _finite("gamma_minus", gamma_minus, 1)
        if w.shape != (len(gamma), len(gamma)):
            raise ArgumentError("delassus", w.shape, f"shape ({len(gamma)}, {len(gamma)}), as gamma_minus")
        size = contact_size or (1 if friction is None else 3)
        coefficients = _per_contact("restitution", restitution, len(gamma), size)
        mu = None if friction is None else _per_contact("friction", friction, len(gamma), size)
        joints = _joints(bilateral, len(coefficients))
        return cls(w, gamma, coefficients, mu, size, relaxed, name, bilateral=joints)

    @property
    def two_sided(self) -> NDArray[np.bool_]:
        """`bilateral` (k,), or all False if it is None."""
        return np.zeros(self.contacts, np.bool_) if self.bilateral is None else self.bilateral

    @property
    def size(self) -> int:
        """Number of unknown impulse components n."""
        return len(self.gamma_minus)

    @property
    def contacts(self) -> int:
        """Number of contacts k."""
        return self.size // self.contact_size

    @property
    def friction_or_zero(self) -> Floats:
        """Friction coefficients (k,), zeros if the problem is frictionless."""
        return np.zeros(self.contacts) if self.friction is None else self.friction

    @cached_property
    def offset(self) -> Floats:
        """The constant b (n,) of w = W p + b: gamma_minus with e gamma_minus added to contacts' normals [m/s]."""
        b = self.gamma_minus.copy()
        b[:: self.contact_size] *= 1.0 + np.where(self.two_sided, 0.0, self.restitution)
        return b

    @cached_property
    def asymmetry(self) -> float:
        """Largest |W - Wᵀ| relative to the largest |W|; a Delassus matrix is symmetric up to rounding."""
        largest = np.abs(self.delassus).max(initial=0.0)
        if largest == 0.0:
            return 0.0
        return float(np.abs(self.delassus - self.delassus.T).max() / largest)

    @cached_property
    def factor(self) -> Floats:
        """A (n, r) with W = A Aᵀ, which is J L⁻ᵀ if the mechanics is known, else from the eigenvectors of W.

        Raises
        ------
        SolverError
            W is not symmetric positive semidefinite, so there is no equivalent convex problem.
        """
        if self.mass_matrix is not None and self.contact_jacobian is not None:
            return _mechanical_factor(self.mass_matrix, self.contact_jacobian)
        if self.asymmetry > SYMMETRY_TOLERANCE:
            raise SolverError(f"refused: W is asymmetric (relative {self.asymmetry:.1e}), not convex")
        return _eigen_factor(self.delassus)

    def contact_velocity(self, impulse: Floats) -> Floats:
        """Return w = W p + b (n,), the velocity complementary to the impulse, before Coulomb's shift [m/s]."""
        return self.delassus @ impulse + self.offset

    def gamma_plus(self, impulse: Floats) -> Floats:
        """Return the contact velocities after the impact, gamma_minus + W p (n,) [m/s]."""
        return self.delassus @ impulse + self.gamma_minus

    def velocity_plus(self, impulse: Floats) -> Floats:
        """Return the generalized velocity after the impact, v + M⁻¹ Jᵀ p (d,); this needs the mechanics."""
        if self.mass_matrix is None or self.contact_jacobian is None or self.velocity is None:
            raise ArgumentError("problem", self.name or "without mechanics", "a problem made by from_impact")
        return self.velocity + np.linalg.solve(self.mass_matrix, self.contact_jacobian.T @ impulse)


def _finite(argument: str, value: Any, dimensions: int) -> Floats:
    array = np.array(value, dtype=np.float64)
    if array.ndim != dimensions:
        raise ArgumentError(argument, array.shape, f"an array of {dimensions} dimensions")
    if not np.isfinite(array).all():
        raise ArgumentError(argument, value, "finite numbers")
    return array


def _check_shapes(mass: Floats, jacobian: Floats, velocity: Floats) -> None:
    d = len(velocity)
    if mass.shape != (d, d):
        raise ArgumentError("mass_matrix", mass.shape, f"shape ({d}, {d}), as velocity")
    if jacobian.shape[1] != d:
        raise ArgumentError("contact_jacobian", jacobian.shape, f"{d} columns, as velocity")


def _per_contact(argument: str, value: ArrayLike, components: int, size: int) -> Floats:
    """Return one coefficient per contact from a scalar or an array, checked against its range."""
    if components % size:
        raise ArgumentError("contact_size", size, f"a divisor of the {components} rows")
    array = np.array(value, dtype=np.float64)
    if array.ndim > 1 or (array.ndim == 1 and len(array) != components // size):
        raise ArgumentError(argument, array.shape, f"a scalar or shape ({components // size},)")
    upper = 1.0 if argument == "restitution" else np.inf
    if not ((array >= 0.0) & (array <= upper) & np.isfinite(array)).all():
        raise ArgumentError(argument, value, "values in [0, 1]" if upper == 1.0 else "finite values >= 0")
    return np.ascontiguousarray(np.broadcast_to(array, components // size))


def _joints(bilateral: ArrayLike | None, blocks: int) -> NDArray[np.bool_] | None:
    if bilateral is None:
        return None
    joints = np.array(bilateral, dtype=np.bool_)
    if joints.shape != (blocks,):
        raise ArgumentError("bilateral", bilateral, f"shape ({blocks},)")
    return joints


def _mechanical_factor(mass: Floats, jacobian: Floats) -> Floats:
    """Return A = J L⁻ᵀ (n, d) with M = L Lᵀ: contact rows in coordinates with the kinetic energy ½|u|²."""
    try:
        cholesky = np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        raise ArgumentError("mass_matrix", mass, "a symmetric positive definite matrix") from None
    return np.linalg.solve(cholesky, jacobian.T).T


def _eigen_factor(delassus: Floats) -> Floats:
    eigenvalues, vectors = np.linalg.eigh(0.5 * (delassus + delassus.T))
    largest = np.abs(eigenvalues).max(initial=0.0)
    if eigenvalues.min(initial=0.0) < -INDEFINITE_TOLERANCE * largest:
        ratio = eigenvalues.min() / largest
        raise SolverError(f"refused: W is indefinite (relative eigenvalue {ratio:.1e}), not convex")
    return vectors * np.sqrt(np.clip(eigenvalues, 0.0, None))
