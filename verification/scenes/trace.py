"""Trace: the part of a run of the peg that the claims use. It is small, so that hundreds fit in memory, and plain, so
that a test can write one by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run

Floats = NDArray[np.float64]

COORDINATES = ("x", "y", "theta")
HALF_SIZE = (0.0105, 0.00525)  # of the peg of Fig. 4 [m]
UNITS = {"x": "m", "y": "m", "theta": "rad"}


@dataclass(frozen=True)
class Trace:
    """Trajectory, forces, contacts and impacts of one run; n steps, 3 coordinates (x, y, theta).

    Attributes
    ----------
    time : (n + 1,) [s]
    device, tool : (n + 1, 3) positions [m, rad]; device_velocity : (n + 1, 3)
    device_force : (n, 3) force of the device's actuators [N, N m]
    hand_force : (n, 3) [N, N m]
    penetration : (n,) deepest overlap in the step [m], zero without overlap
    new_contact : (n,) whether a contact began in the step
    impact_step : (k,) steps with a collision; energy_lost : (k,) [J]; impact_scale : (k,) share of the impulse
    kinetic_energy : (n + 1,) of the tool [J]
    """

    time: Floats
    device: Floats
    tool: Floats
    device_velocity: Floats
    device_force: Floats
    hand_force: Floats
    penetration: Floats
    new_contact: NDArray[np.bool_]
    impact_step: NDArray[np.int64]
    energy_lost: Floats
    impact_scale: Floats
    kinetic_energy: Floats

    @property
    def dt(self) -> float:
        """Step [s]."""
        return float(self.time[1] - self.time[0])

    @property
    def first_contact(self) -> int:
        """Index of the step with the first contact; the number of steps if there is no contact."""
        steps = np.flatnonzero(self.new_contact)
        return int(steps[0]) if len(steps) else len(self.new_contact)


def trace_of(run: Run) -> Trace:
    """Return the trace of a run of the peg."""
    step = np.repeat(np.arange(run.steps), np.diff(run.contacts.offsets))
    penetration, new_contact = np.zeros(run.steps), np.zeros(run.steps, np.bool_)
    np.maximum.at(penetration, step, np.maximum(-run.contacts.gap, 0.0))
    np.logical_or.at(new_contact, step, run.contacts.is_new)
    body = run.scene_resolved["bodies"][0]
    inertia = np.array([body["mass"], body["mass"], body["inertia"]])
    return Trace(
        run.time, run.device_q, run.q, run.device_v, run.device_force, run.hand_force, penetration, new_contact,
        run.impacts.step, run.impacts.energy_lost, run.impacts.scale, 0.5 * (run.v**2) @ inertia,
    )  # fmt: skip
