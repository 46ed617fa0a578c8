"""Energy balance of a run (the ledger): stored energy, work of each force, impact loss, residual of
the integrator.

Over step k the configuration moves by the displacement Dq_k = difference(q_k, q_k+1) (q_k+1 - q_k
on vector coordinates), that is by the velocity actually integrated. The work of a force F_k held
over the step is F_k . Dq_k: what a force sensor and a position sensor would measure. The impulse of
step k acts at q_k on v_k, before the forces, or within the step: then the loss is that of its
impacts. Then, summed over the steps so far,

    kinetic + potential - initial = hand + coupling + penalty + friction work - impact_loss +
    residual.

The residual is energy that the time integration created (> 0) or lost (< 0); over a given time it
falls with the step. One step of semi-implicit Euler, for example, moves by v_k+1 while the kinetic
energy changes by F . (v_k + v_k+1) / 2 dt (constant M): it loses F . M^-1 F dt^2 / 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iapb.mechanics.kernels.evaluation import impact_loss
from iapb.mechanics.mechanism import Mechanism
from iapb.numerics.compiled import Entry
from iapb.numerics.schema import Floats
from iapb.run import Run

FORCES = ("hand", "coupling", "penalty", "friction")
_impact_loss = Entry(impact_loss)


def port_energy(force: Floats, displacement: Floats, before: float = -0.0) -> Floats:
    """Return the energy (n,) [J] that has entered through a port by the end of each step: sum of F
    . Dq.

    This is the passivity observer of Hannaford and Ryu (2002) for force (n, d) and displacement (n,
    d); `before` is the energy [J] that entered in earlier steps.
    """
    return _summed(np.einsum("nd,nd->n", force, displacement), before)


def _summed(values: Floats, before: float = -0.0) -> Floats:
    """Return the running sums, added in order: in parts or at once, with the same bits (−0.0
    changes no sum)."""
    return np.cumsum(np.append(before, values))[1:]


def impact_losses(mechanism: Mechanism, q: Floats, v: Floats, impulse: Floats) -> Floats:
    """Return the kinetic energy (n,) [J] taken by the generalized impulse (n, d) at q_k, v_k of
    each step.

    The loss is -(v . P + P . M^-1 P / 2). This is exact also if the clamp or a force limit removed
    part of the impulse.
    """
    losses = np.zeros(len(impulse))
    change = np.zeros(mechanism.nv)
    lower = np.zeros((mechanism.nv, mechanism.nv))
    for k in np.flatnonzero(impulse.any(axis=1)):
        mass_matrix = mechanism.mass_matrix(q[0 if mechanism.has_constant_mass_matrix else k])
        losses[k] = _impact_loss(mass_matrix, lower, v[k], impulse[k], change)
    return losses


class Steps(NamedTuple):
    """n steps of a mechanism."""

    #: (n + 1, nq) and (n + 1, d): states at the beginning of each step and at the end of the last
    q: Floats
    v: Floats
    #: name -> (n, d) [N, N m]: generalized forces over each step; gravity is not among them
    forces: Mapping[str, Floats]
    impulse: Floats  #: (n, d) [N s, N m s] at the beginning of each step
    #: whether free bodies moved straight, by the integrator `momentum` (see
    #: `Mechanism.displacements`)
    straight: bool = False
    #: (n,) [J] lost in the impacts of each step, where these happen within it; NaN: it follows from
    #: the impulse, at the beginning of the step
    lost: Floats | None = None


def energy_ledger(
    mechanism: Mechanism,
    gravity: ArrayLike,
    steps: Steps,
    before: Mapping[str, float] | None = None,
) -> dict[str, Floats]:
    """Return the energy balance of n steps.

    Parameters
    ----------
    gravity : (3,) [m/s^2]
    before : ledger name -> [J], optional
        Sums at the end of the preceding steps (see `last_of`); the sums of these n steps continue
        them.

    Returns
    -------
    dict
        `kinetic`, `potential` (n + 1,) [J]; `<name>_work` of each force, `impact_loss` and
        `integration_residual` (n,) [J], sums from the start to the end of each step.
    """
    q, v, forces, impulse, straight, lost = steps
    kinetic, potential = mechanism.energies(q, v, gravity)
    displacement = mechanism.displacements(q, straight)
    before = before or {}
    ledger = {"kinetic": kinetic, "potential": potential}
    for name, force in forces.items():
        ledger[f"{name}_work"] = port_energy(force, displacement, before.get(f"{name}_work", -0.0))
    losses = impact_losses(mechanism, q, v, impulse)
    if lost is not None:
        losses = np.where(np.isnan(lost), losses, lost)
    ledger["impact_loss"] = _summed(losses, before.get("impact_loss", -0.0))
    total = kinetic + potential
    explained = sum((ledger[f"{name}_work"] for name in forces), -ledger["impact_loss"])
    ledger["integration_residual"] = total[1:] - before.get(_AT_FIRST, total[0]) - explained
    return ledger


_AT_FIRST = "energy at the start"


def last_of(ledger: Mapping[str, Floats], before: Mapping[str, float] | None) -> dict[str, float]:
    """Return the sums at the end of a ledger, as the argument `before` for the steps that
    follow."""
    first = {_AT_FIRST: ledger["kinetic"][0] + ledger["potential"][0]}
    return (
        first
        | dict(before or {})
        | {name: values[-1] for name, values in ledger.items() if len(values)}
    )


def moved_straight(run: Run) -> bool:
    """Whether the free bodies of a run moved straight in each step (see
    `Mechanism.displacements`)."""
    return run.law_settings.get("integrator") == "momentum"


def lost_within(run: Run) -> Floats:
    """Return the energy lost in the impacts of each step (n,) [J]; NaN where none happens within
    the step."""
    impacts = run.impacts
    lost = np.zeros(run.steps)
    step = impacts.step - round(run.time[0] / run.dt)
    np.add.at(lost, step, impacts.energy_lost)
    lost[np.setdiff1d(np.arange(run.steps), step[impacts.time > impacts.step * run.dt])] = np.nan
    return lost


def energy_of_run(
    run: Run,
    mechanism: Mechanism,
    gravity: ArrayLike,
    device: Mechanism | None = None,
    before: Mapping[str, float] | None = None,
) -> dict[str, Floats]:
    """Return the energy balance of a run, or of its part after `before` (see `energy_ledger`), with
    the device.

    The device adds `device_kinetic` (n + 1,), `device_hand_work` (work of the hand's force on the
    device: the energy that has entered the system through the hand's port) and
    `device_actuator_work` (n,), all [J].
    """
    forces = {name: getattr(run, f"{name}_force") for name in FORCES}
    before = before or {}
    steps = Steps(run.q, run.v, forces, run.impulse, moved_straight(run), lost_within(run))
    ledger = energy_ledger(mechanism, gravity, steps, before)
    if device is not None and run.device_q.shape[1]:
        moved = device.displacements(run.device_q)
        ledger["device_kinetic"], _ = device.energies(run.device_q, run.device_v, gravity)
        for name, force in (
            ("hand", run.hand_force[:, slice(*run.tool_dofs)]),
            ("actuator", run.device_force),
        ):
            ledger[f"device_{name}_work"] = port_energy(
                force, moved, before.get(f"device_{name}_work", -0.0)
            )
    return ledger
