"""The energy ledger closes: every work is its force along the displacement, impacts lose what they lost, and with a
constant mass matrix the rest is known exactly: semi-implicit Euler loses ½ Δv·M Δv per step, Δv by the forces, and
takes the weight −G as constant over a step.
"""

from __future__ import annotations

import numpy as np

from verification.properties.case import LawResidual
from verification.properties.trajectory_laws.trajectory import EPS, Floats, Trajectory

_FORCES = ("hand", "coupling", "penalty", "friction")
HALF_TURN = np.pi / np.sqrt(3.0)  # [rad] of each of the three rates of a body


def ledger_closes(trajectory: Trajectory) -> LawResidual | None:
    """Largest difference of an account from its recomputation, over the energy that was turned over."""
    run = trajectory.run
    if not (trajectory.by_the_engine and trajectory.carries_itself) or not run.energy:
        return None
    works = {name: np.einsum("nd,nd->n", getattr(run, f"{name}_force"), trajectory.displacements) for name in _FORCES}
    kinetic, potential = _energies(trajectory)
    size = float(np.max(kinetic) + np.max(np.abs(potential)) + sum(np.sum(np.abs(work)) for work in works.values()))
    wrong = [_apart(np.cumsum(works[name]), run.energy[f"{name}_work"]) for name in _FORCES]
    wrong += [_apart(kinetic, run.energy["kinetic"]), _apart(potential, run.energy["potential"])]
    wrong += [_apart(_impact_losses(trajectory), run.energy["impact_loss"]), _apart(*_residuals(trajectory))]
    return LawResidual("ledger", max(wrong) / max(size, np.finfo(float).tiny), 10.0 * len(run.time) * EPS)


def _energies(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """½ vᵀMv by einsum, and the potential energy of the scene, at all instants."""
    from iapb.mechanics.energy import energies

    run, system = trajectory.run, trajectory.system
    _, potential = energies(system.mechanism, system.gravity, run.q, run.v)
    last = system.mechanism.mass_matrix(run.q[-1])[None]
    masses = np.concatenate([trajectory.masses, last])
    return 0.5 * np.einsum("ni,nij,nj->n", run.v, masses, run.v), potential


def _impact_losses(trajectory: Trajectory) -> Floats:
    """Energies lost by the impacts of each step, summed; each from its own velocities before and after."""
    impacts, losses = trajectory.run.impacts, np.zeros(trajectory.run.steps)
    masses = trajectory.masses[impacts.step]
    lost = -0.5 * np.einsum(
        "ki,kij,kj->k", impacts.v_plus - impacts.v_minus, masses, impacts.v_plus + impacts.v_minus
    )
    np.add.at(losses, impacts.step, lost)
    return np.asarray(np.cumsum(losses))


def _residuals(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """What the integration made, as recorded and as it must be.

    Nothing to compare where M varies, or where a body in space turns by half a turn in a step: its displacement is
    then no longer the motion that was integrated.
    """
    run, mechanism = trajectory.run, trajectory.system.mechanism
    turns = mechanism.nq != mechanism.nv and run.dt * np.max(np.abs(run.v[1:]), initial=0.0) >= HALF_TURN
    if turns or not mechanism.has_constant_mass_matrix:
        return np.zeros(1), np.zeros(1)
    dv = run.v[1:] - trajectory.v_struck
    lost = 0.5 * np.einsum("ni,nij,nj->n", dv, trajectory.masses, dv)
    constant_weight = np.einsum("nd,nd->n", trajectory.bias_and_gravity, trajectory.displacements)
    made = np.diff(run.energy["potential"]) - constant_weight - lost
    return run.energy["integration_residual"], np.cumsum(made)


def _apart(one: Floats, other: Floats) -> float:
    return float(np.max(np.abs(one - other), initial=0.0))
