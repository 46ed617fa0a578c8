"""For every finite input, even huge, tiny or singular, the resolver returns a finite velocity or raises IapbError."""

from __future__ import annotations

import numpy as np

from iapb import resolve_impact
from iapb.errors import IapbError
from verification.impacts import Floats, ImpactCase, draw_mass_matrix, draw_rows
from verification.laws.bounds import LawResidual
from verification.laws.resolver import Resolver

SIZES = (5e-324, 1e-310, 1e-160, 1e-30, 1.0, 1e30, 1e160, 1.7e308)
MASS_KINDS = ("spectral", "graded", "singular", "indefinite", "asymmetric", "zero")
ROW_KINDS = ("generic", "dependent", "scaled", "copies", "none", "zeros", "huge")


def draw(rng: np.random.Generator) -> ImpactCase:
    """Draw M, J and v with magnitudes between the smallest and the largest double; M is not always a mass matrix."""
    d = int(rng.integers(1, 7))
    kind, rows_kind = str(rng.choice(MASS_KINDS)), str(rng.choice(ROW_KINDS))
    mass = _mass(rng, kind, d)
    rows = draw_rows(rng, "generic" if rows_kind == "huge" else rows_kind, np.eye(d))[0]
    with np.errstate(over="ignore", under="ignore"):
        mass, rows, v = (_sized(rng, array) for array in (mass, rows, rng.normal(size=d)))
    e = float(rng.choice([-1.0, 0.0, 1.0, 0.3]))
    return ImpactCase(mass, rows, v, e, f"{kind} mass, {rows_kind} rows, extreme sizes")


def _mass(rng: np.random.Generator, kind: str, d: int) -> Floats:
    mass = draw_mass_matrix(rng, "graded" if kind == "graded" else "spectral", d, 10.0 ** rng.uniform(0.0, 18.0))
    if kind == "singular":
        mass = np.outer(mass[0], mass[0])
    if kind == "indefinite":
        mass = mass - 2.0 * np.diag(mass)[rng.integers(d)] * np.eye(d)
    if kind == "asymmetric":
        mass = mass + np.triu(rng.normal(size=(d, d)), 1)
    return np.zeros((d, d)) if kind == "zero" else mass


def _sized(rng: np.random.Generator, array: Floats) -> Floats:
    """Scale the array by one magnitude, or each entry by its own (symmetric for a square array); keep it finite."""
    sizes = rng.choice(SIZES, size=array.shape) if rng.random() < 0.2 else float(rng.choice(SIZES))
    if isinstance(sizes, np.ndarray) and array.ndim == 2 and array.shape[0] == array.shape[1]:
        sizes = np.maximum(sizes, sizes.T)
    return np.asarray(np.clip(array * sizes, -1.7e308, 1.7e308))


def ours(M: Floats, J: Floats, v: Floats, e: float) -> object:
    """Call the engine's resolver."""
    return resolve_impact(M, J, v, e)


def finite_or_named(case: ImpactCase, subject: Resolver) -> LawResidual:
    """0 if the resolver returns a finite velocity or raises an IapbError, else 1; the tolerance is 0."""
    try:
        answer = subject(case.mass_matrix.copy(), case.contact_jacobian.copy(), case.velocity.copy(), case.restitution)
        v_plus = np.asarray(getattr(answer, "velocity", answer))
        fine = v_plus.shape == case.velocity.shape and bool(np.all(np.isfinite(v_plus)))
    except IapbError:
        fine = True
    except Exception:  # any other exception breaks the law
        fine = False
    return LawResidual("extremes", 0.0 if fine else 1.0, 0.0)
