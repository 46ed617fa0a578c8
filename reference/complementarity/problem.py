"""ImpactProblem: an impact (or one time step) as a complementarity problem over contact impulses.

Frictionless, by Newton's law:  0 <= p ⟂ gamma_plus + E gamma_minus >= 0,  gamma_plus = gamma_minus
+ W p. With friction mu and blocks (normal, tangent...):  K ∋ p ⟂ u + mu |u_T| n ∈ K*  (Coulomb's
law, an NCP), where u is gamma_plus with E gamma_minus added to its normals. `relaxed` drops the
shift mu |u_T|: the CCP.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError, SolverError
from reference import Floats

# Rounding of n products leaves an asymmetry of n·eps, files with 12 digits 1e-11; above this
# tolerance the matrix itself is asymmetric.
SYMMETRY_TOLERANCE = 1e-9

# A W from single precision or subtraction has eigenvalues down to -1e-7 of the largest. Up to this
# tolerance the nearest semidefinite W is solved instead; residuals still use the given W.
INDEFINITE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class ImpactProblem:
    """A contact problem with n = contacts x contact_size unknown impulses p [N s]."""

    delassus: Floats  #: (n, n) W = J M⁻¹ Jᵀ [1/kg]
    #: (n,) contact velocities J v⁻ before the impact [m/s]; normals > 0 separate
    gamma_minus: Floats
    restitution: Floats  #: (k,) Newton's e of each contact, in [0, 1]
    #: (k,) Coulomb's mu, or None for frictionless contacts (then contact_size is 1)
    friction: Floats | None = None
    contact_size: int = 1  #: components per contact, normal first: 1, 2 (planar friction) or 3
    relaxed: bool = False  #: True drops the shift mu |u_T| from Coulomb's law (convex relaxation)
    name: str = ""
    mass_matrix: Floats | None = None  #: the mechanics (d, d), (n, d), (d,), if known
    contact_jacobian: Floats | None = None
    velocity: Floats | None = None

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
        name: str = "",
    ) -> ImpactProblem:
        """Return the problem of an impact of velocity v (d,) on rows J (n, d) with mass matrix M
        (d, d).

        The contact velocities of dependent rows are made consistent, and are 0 if all of them are
        rounding: opposed rows contradict each other in the rounding of J v, which is as large as
        |v|, and no solver finds an answer then.
        """
        v = _array("velocity", velocity, (None,))
        mass = _array("mass_matrix", mass_matrix, (len(v), len(v)))
        jacobian = _array("contact_jacobian", contact_jacobian, (None, len(v)))
        factor = _mechanical_factor(mass, jacobian)
        contacts = _contacts(len(jacobian), contact_size, restitution, friction, relaxed, name)
        # of v itself, and of the products
        rounding = 2 * len(v) * np.finfo(np.float64).eps * (np.abs(jacobian) @ np.abs(v))
        return cls(
            factor @ factor.T,
            _consistent(mass, factor, jacobian @ v, rounding),
            **contacts,
            mass_matrix=mass,
            contact_jacobian=jacobian,
            velocity=v,
        )

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
        name: str = "",
    ) -> ImpactProblem:
        """Return the problem of W (n, n) and gamma_minus (n,); with e = 0 it is the LCP (W,
        gamma_minus)."""
        gamma = _array("gamma_minus", gamma_minus, (None,))
        w = _array("delassus", delassus, (len(gamma), len(gamma)))
        return cls(
            w, gamma, **_contacts(len(gamma), contact_size, restitution, friction, relaxed, name)
        )

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
        """The constant b (n,) of w = W p + b: gamma_minus with e gamma_minus added to contacts'
        normals [m/s]."""
        b = self.gamma_minus.copy()
        b[:: self.contact_size] *= 1.0 + self.restitution
        return b

    @cached_property
    def asymmetry(self) -> float:
        """Largest |W - Wᵀ| relative to the largest |W|; a Delassus matrix is symmetric up to
        rounding."""
        largest = float(np.abs(self.delassus).max(initial=0.0)) or 1.0
        return float(np.abs(self.delassus - self.delassus.T).max(initial=0.0) / largest)

    @cached_property
    def factor(self) -> Floats:
        """A (n, r) with W = A Aᵀ, which is J L⁻ᵀ if the mechanics is known, else from the
        eigenvectors of W.

        Raises
        ------
        SolverError
            W is not symmetric positive semidefinite, so there is no equivalent convex problem.
        """
        if self.mass_matrix is not None and self.contact_jacobian is not None:
            return _mechanical_factor(self.mass_matrix, self.contact_jacobian)
        if self.asymmetry > SYMMETRY_TOLERANCE:
            raise SolverError(
                f"refused: W is asymmetric (relative {self.asymmetry:.1e}), not convex"
            )
        eigenvalues, vectors = np.linalg.eigh(0.5 * (self.delassus + self.delassus.T))
        least = eigenvalues.min(initial=0.0)
        largest = np.abs(eigenvalues).max(initial=0.0)
        if least < -INDEFINITE_TOLERANCE * largest:
            raise SolverError(
                f"refused: W is indefinite (relative eigenvalue {least / largest:.1e}), not convex"
            )
        return np.asarray(vectors * np.sqrt(np.clip(eigenvalues, 0.0, None)))

    def contact_velocity(self, impulse: Floats) -> Floats:
        """Return w = W p + b (n,), the velocity complementary to the impulse, before Coulomb's
        shift [m/s]."""
        return self.delassus @ impulse + self.offset

    def gamma_plus(self, impulse: Floats) -> Floats:
        """Return the contact velocities after the impact, gamma_minus + W p (n,) [m/s]."""
        return self.delassus @ impulse + self.gamma_minus

    def velocity_plus(self, impulse: Floats) -> Floats:
        """Return the generalized velocity after the impact, v + M⁻¹ Jᵀ p (d,); this needs the
        mechanics."""
        if self.mass_matrix is None or self.contact_jacobian is None or self.velocity is None:
            raise ArgumentError(
                "problem", self.name or "without mechanics", "a problem made by from_impact"
            )
        return self.velocity + np.linalg.solve(self.mass_matrix, self.contact_jacobian.T @ impulse)


def _array(argument: str, value: Any, shape: tuple[int | None, ...]) -> Floats:
    """Return finite numbers of this shape, in which None is any length."""
    array = np.array(value, dtype=np.float64)
    if array.ndim != len(shape) or any(
        b not in (None, a) for a, b in zip(array.shape, shape, strict=True)
    ):
        raise ArgumentError(argument, array.shape, f"shape {shape}".replace("None", "n"))
    if not np.isfinite(array).all():
        raise ArgumentError(argument, value, "finite numbers")
    return array


def _contacts(
    rows: int,
    contact_size: int | None,
    restitution: ArrayLike,
    friction: ArrayLike | None,
    relaxed: bool,
    name: str,
) -> dict[str, Any]:
    """Return the fields of an ImpactProblem that describe its contacts, each coefficient as an
    array (k,)."""
    size = contact_size or (1 if friction is None else 3)
    if rows % size:
        raise ArgumentError("contact_size", size, f"a divisor of the {rows} rows")
    found: dict[str, Any] = {"contact_size": size, "relaxed": relaxed, "name": name}
    for argument, value, upper in (
        ("restitution", restitution, 1.0),
        ("friction", friction, np.inf),
    ):
        if value is not None:
            array = np.array(value, dtype=np.float64)
            if array.shape not in ((), (rows // size,)):
                raise ArgumentError(argument, array.shape, f"a scalar or shape ({rows // size},)")
            if not ((array >= 0.0) & (array <= upper) & np.isfinite(array)).all():
                raise ArgumentError(
                    argument, value, "values in [0, 1]" if upper == 1.0 else "finite values >= 0"
                )
            found[argument] = np.ascontiguousarray(np.broadcast_to(array, rows // size))
    return found


def _consistent(mass: Floats, factor: Floats, gamma: Floats, rounding: Floats) -> Floats:
    """Return the contact velocities (n,) nearest to `gamma` that some motion has on the rows of A,
    or 0 if all are rounding; `gamma` itself if the rows are independent.

    The triangular solve for A errs by n ε √κ(M): unit rows dependent to this are dependent.
    """
    dependent = max(*factor.shape, 1) * np.finfo(np.float64).eps * np.sqrt(np.linalg.cond(mass))
    length = np.linalg.norm(factor, axis=1)
    length[length == 0.0] = 1.0
    unit = factor / length[:, None]
    motion, _, rank, _ = np.linalg.lstsq(unit, gamma / length, rcond=float(dependent))
    if rank == len(gamma):
        return gamma
    return np.asarray(length * (unit @ motion)) * (np.abs(gamma) > rounding).any()


def _mechanical_factor(mass: Floats, jacobian: Floats) -> Floats:
    """Return A = J L⁻ᵀ (n, d) with M = L Lᵀ: contact rows in coordinates with the kinetic energy
    ½|u|²."""
    try:
        cholesky = np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        raise ArgumentError("mass_matrix", mass, "a symmetric positive definite matrix") from None
    return np.linalg.solve(cholesky, jacobian.T).T
