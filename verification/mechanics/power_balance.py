"""Power balance d(KE + PE)/dt = tau . v of random trees, to the order of each integrator; and definiteness of M.

Over one step dt the energy changes by the work of tau, integrated by Simpson's rule from the velocities at the start,
the middle and the end. The defect of this balance, divided by dt, falls as dt^order if M, B, G and the energies are
consistent; if any term is wrong, the defect does not fall.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from iapb.mechanics.integrators import INTEGRATORS, Integrator
from iapb.mechanics.mechanism import Mechanism
from reference import Floats
from reference.random_mechanisms import random_mechanism, random_state
from verification.check import Check, Study
from verification.table import Row

FIELD = np.array([0.5, -9.81, 2.0])  # [m/s^2], along no axis
METHODS = ("semi_implicit_euler", "midpoint")
SIZES = (1, 3, 10, 30)  # joints
TREES = {"quick": 15, "full": 200}
LONGEST = 2e-2  # [s]; halved until the defect is below SMALL^order, where the leading error term dominates
HALVINGS = 14
SMALL = 0.02
NEGLIGIBLE = 1e-10  # smaller relative defects are close to rounding
SPEED = 0.3  # [m/s, rad/s]: the motion is smooth over such a step
ORDER_TOLERANCE = 0.25  # of the median over trees, for the next error terms, which are larger in long chains
# Condition number of M scaled to a unit diagonal, above which rounding determines the sign of the least eigenvalue.
LARGEST_CONDITION = 1e12
LEAST_SHARE = 0.5  # share of the trees that must show an order; if a term is missing, no tree does
SEED = 20050603


def _row(study: Study, case: tuple[str, int]) -> Row:
    (name, joints), trees = case, TREES[study.depth]
    method, rng = INTEGRATORS[name], np.random.default_rng([SEED, joints])
    found, tried = [], 0
    for _ in range(trees):
        mechanism = random_mechanism(rng, joints)
        q, v = random_state(rng, mechanism, SPEED)
        tau = mechanism.inverse_dynamics(q, v, rng.normal(size=mechanism.nv), FIELD)
        if np.any(tau * v) and _condition(mechanism.mass_matrix(q)) <= LARGEST_CONDITION:
            tried += 1
            found += order_of(mechanism, method, q, v, tau)
    medians = np.median(found, axis=0) if found else np.full(3, np.nan)
    return {"integrator": name, "joints": joints, "trees": tried, "trees that show an order": len(found),
            "step [s]": float(medians[0]), "median defect [of |τ|·|v| dt]": float(medians[1]),
            "median order": float(medians[2]), "declared order": method.order}  # fmt: skip


def order_of(
    mechanism: Mechanism, method: Integrator, q: Floats, v: Floats, tau: Floats
) -> list[tuple[float, float, float]]:
    """Return [(step, defect, order)] at the longest step whose defect is small; empty if there is none."""
    coarse = np.inf
    for k in range(HALVINGS):
        dt = LONGEST * 0.5**k
        fine = defect(mechanism, method, q, v, tau, dt)
        if NEGLIGIBLE <= coarse <= SMALL**method.order and fine > 0.0:
            return [(2.0 * dt, coarse, float(np.log2(coarse / fine)))]
        coarse = fine
    return []


def defect(mechanism: Mechanism, method: Integrator, q: Floats, v: Floats, tau: Floats, dt: float) -> float:
    """Energy that one step dt creates or loses, relative to |tau| . |v| dt."""

    def acceleration(q: Floats, v: Floats) -> Floats:
        force = tau - mechanism.bias(q, v) - mechanism.gravity(q, FIELD)
        return np.array(np.linalg.solve(mechanism.mass_matrix(q), force), np.float64)

    def energy(q: Floats, v: Floats) -> float:
        return mechanism.kinetic_energy(q, v) + mechanism.potential_energy(q, FIELD)

    _, v_half = method.step(mechanism.integrate, acceleration, q, v, 0.5 * dt)
    q_next, v_next = method.step(mechanism.integrate, acceleration, q, v, dt)
    work = float(tau @ (v + 4.0 * v_half + v_next)) * dt / 6.0
    return abs(energy(q_next, v_next) - energy(q, v) - work) / (float(np.abs(tau) @ np.abs(v)) * dt)


def _scaled(mass: Floats) -> Floats:
    """M scaled to a unit diagonal, which removes the units of the coordinates."""
    scale = 1.0 / np.sqrt(np.diag(mass))
    return mass * np.outer(scale, scale)


def _condition(mass: Floats) -> float:
    return float(np.linalg.cond(_scaled(mass))) if np.all(np.diag(mass) > 0.0) else np.inf


def as_declared(row: Row) -> bool:
    """Whether the median order is the declared one, and at least half of the trees show an order."""
    enough = row["trees that show an order"] >= LEAST_SHARE * row["trees"]
    return bool(enough and abs(row["median order"] - row["declared order"]) <= ORDER_TOLERANCE)


def _definite(study: Study, joints: int) -> Row:
    count = 10 * TREES[study.depth]
    rng = np.random.default_rng([SEED, joints, 1])
    conditions, least = [], []
    for _ in range(count):
        mechanism = random_mechanism(rng, joints)
        mass = mechanism.mass_matrix(random_state(rng, mechanism)[0])
        condition = _condition(mass) if mechanism.nv else np.inf
        if condition <= LARGEST_CONDITION:
            conditions.append(condition)
            least.append(float(np.linalg.eigvalsh(_scaled(mass))[0]) * condition)
    return {"joints": joints, "mass matrices": count, "judged, condition ≤ 1e12": len(conditions),
            "largest condition judged": max(conditions), "least eigenvalue × condition": min(least)}  # fmt: skip


POWER_BALANCE = Check(
    key="power balance", question="Energy changes by the work of the generalized forces, up to a defect with the "
    "order of the integrator.", cases=lambda _: product(METHODS, SIZES), row=_row, holds=as_declared,
    spans=("median order",), note="Defect: energy that a step creates or loses. Tolerance: median order within "
    f"{ORDER_TOLERANCE} of the declared order.",
)  # fmt: skip
POSITIVE_DEFINITE = Check(
    key="positive definite", question="The mass matrix is positive definite wherever rounding permits a judgement.",
    cases=lambda _: SIZES, row=_definite, spans=("largest condition judged", "least eigenvalue × condition"),
    holds=lambda row: bool(row["least eigenvalue × condition"] > 0.0),
    note="Condition and eigenvalue are those of M scaled to a unit diagonal. A row holds if all judged eigenvalues are "
    f"positive. Above a condition of {LARGEST_CONDITION:g} rounding decides the sign, so the matrix is not judged.",
)  # fmt: skip
