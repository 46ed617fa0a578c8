"""Comparison of the engine with independent references: Pinocchio and complementarity solvers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from iapb import resolve_impact
from iapb.run import Run
from iapb.scene import find_scene, load_scene
from iapb.scene.mechanism import mechanism_of
from reference.complementarity import ImpactProblem, solve
from reference.rigid_body import impulse_dynamics, model_of
from verification.finding import (
    REFUTED,
    REPRODUCED,
    Column,
    Failure,
    Finding,
    Part,
    Row,
    finding_of,
    of_each,
    table_of,
)

_STATES = 100
_SCENES = ("two_link_arm_a", "peg_corner")
_SOLVERS = ("cvxpy_clarabel", "lemke", "daqp")
_EPS = float(np.finfo(float).eps)
COLUMNS = (
    Column("quantity"), Column("against"), Column("cases"), Column("largest difference"), Column("tolerance"),
    Column("why this tolerance", prose=True),
)  # fmt: skip


def cross_checks(run: Callable[..., Run], depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compare mass matrices, Jacobians, impacts of independent rows, and one contact by an LCP; `run` is unused."""
    rng, failures = np.random.default_rng(1), list[Failure]()
    checks = [
        *of_each(_SCENES, lambda name: _mechanism(name, rng), failures),
        *of_each(("impulse dynamics",), _impulse_dynamics, failures),
        *of_each(_SOLVERS, _complementarity, failures),
    ]
    progress(1, 1)
    return finding(checks, failures)


def finding(checks: list[dict[str, Any]], failures: list[Failure]) -> Finding:
    """Return the Finding with one part per comparison."""
    table = table_of(COLUMNS, checks, digits=2).judged(_agrees)
    parts = [
        Part(f"{row['quantity'][:1].upper()}{row['quantity'][1:]}, compared with {row['against']}: the largest "
             f"difference in {row['cases']} cases is {row['largest difference']:.2g} (tolerance {row['tolerance']:g}).",
             REPRODUCED if _agrees(row) else REFUTED)
        for row in checks
    ]  # fmt: skip
    answer = (f"{sum(map(_agrees, checks))} of {len(checks)} comparisons with Pinocchio and with complementarity "
              "solvers agree within the stated tolerance.")
    question = "The engine's quantities are compared with those of programs that share no algorithm with it."
    return finding_of("cross-checks", "Independent answers", question, answer, parts, {"comparisons": table}, failures)


def _agrees(row: Row) -> bool:
    return bool(row["largest difference"] <= row["tolerance"])


def _check(quantity: str, against: str, values: list[float], tolerance: float, reason: str) -> dict[str, Any]:
    return {"quantity": quantity, "against": against, "cases": len(values), "largest difference": float(max(values)),
            "tolerance": tolerance, "why this tolerance": reason}  # fmt: skip


def _mechanism(name: str, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    mechanism = mechanism_of(load_scene(find_scene(name)))
    model, mass, rows = model_of(mechanism), [], []
    for _ in range(_STATES):
        q, point = rng.normal(size=mechanism.nq), np.append(rng.normal(size=2), 0.0)
        mass.append(_distance(mechanism.mass_matrix(q), model.mass_matrix(q)))
        body = len(mechanism.names) - 1
        rows.append(_distance(mechanism.point_jacobian(q, body, point), model.point_jacobian(
            q, mechanism.names[body], point)))
    reason = "1e-11 of the largest entry: a hundred roundings"
    yield _check(f"mass matrix, {name}", "Pinocchio", mass, 1e-11, reason)
    yield _check(f"contact-point Jacobian, {name}", "Pinocchio", rows, 1e-11, reason)


def _distance(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(np.max(np.abs(ours - theirs)) / max(1.0, float(np.max(np.abs(theirs)))))


def _impulse_dynamics(_name: str) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng(2)
    ratio, easy = [], []
    for _ in range(2000):
        d = int(rng.integers(1, 13))
        c = int(rng.integers(1, d + 1))
        root = rng.normal(size=(d, d))
        M = root @ root.T + 10.0 ** rng.uniform(-2, 1) * np.eye(d)
        J, v, e = rng.normal(size=(c, d)), rng.normal(size=d), float(rng.uniform(-1, 1))
        L = np.linalg.cholesky(M)
        condition = float(np.linalg.cond(np.linalg.solve(L, J.T)))
        if condition > 1e6:
            continue
        ours, theirs = resolve_impact(M, J, v, e).velocity, impulse_dynamics(M, J, v, e)
        error = float(np.linalg.norm(L.T @ (ours - theirs)) / np.linalg.norm(L.T @ v))
        ratio.append(error / (100.0 * d * _EPS * condition**2))
        if condition <= 10.0:
            easy.append(error)
    yield _check("v⁺ of independent rows, as a share of 100 d ε κ(A)²", "Pinocchio impulseDynamics", ratio, 1.0,
                 "a hundred roundings per coordinate, times κ(A)², the condition of the Delassus matrix that it forms")
    yield _check("v⁺ where κ(A) ≤ 10, kinetic metric", "Pinocchio impulseDynamics", easy, 1e-12, "plain rounding")


def _complementarity(name: str) -> Iterator[dict[str, Any]]:
    rng, errors = np.random.default_rng(3), []
    for _ in range(60):
        d = int(rng.integers(1, 9))
        root = rng.normal(size=(d, d))
        M, v, e = root @ root.T + np.eye(d), rng.normal(size=d), float(rng.uniform(0, 1))
        J = rng.normal(size=(1, d))
        J *= -np.sign(J @ v)  # approaching
        L, ours = np.linalg.cholesky(M), resolve_impact(M, J, v, e).velocity
        theirs = solve(ImpactProblem.from_impact(M, J, v, e), name).velocity_plus
        errors.append(float(np.linalg.norm(L.T @ (ours - theirs)) / np.linalg.norm(L.T @ v)))
    tolerance = 1e-6 if name.startswith("cvxpy") else 1e-12
    yield _check("v⁺ of one contact (C05)", name, errors, tolerance, "the solver's own accuracy")
