"""Pinocchio: free motion by its articulated-body algorithm, impacts by its `impulseDynamics`.

Pinocchio is not a simulator. The contact detection of the rigid world finds the contacts here, and the approaching rows
are passed to `impulseDynamics`, which is bilateral and has one e for all rows.
"""

from __future__ import annotations

import numpy as np

from iapb.system import System
from reference.contact_rows import find_rows
from reference.rigid_body import model_of
from reference.simulators.own_engines import own_scene, world_state
from reference.simulators.scene import FixedScene
from reference.simulators.simulator import Settings, Simulator
from reference.simulators.trajectory import Samples, Trajectory, steps_between_samples

STEP = 1e-3  # [s] Pinocchio has no default step
DAMPING, DAMPING_OF_A_STACK = 1e-14, 1e-8  # [1/kg] the best of 0, 1e-14, 1e-12, 1e-10, 1e-8 and 1e-6 on these scenes
MANY_TIMES_HEAVIER = 1e3  # mass ratio from which the larger damping is needed
APPROACHES = 1e-12  # [m/s] a slower approach is rounding error of a contact at rest


class Pinocchio(Simulator):
    """Adapter to Pinocchio's impulse dynamics."""

    title, module, package = "Pinocchio", "pinocchio", "pin"

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return the settings, with the damping of the Delassus matrix that redundant rows need.

        Without the damping, the wedge loses a third of its energy.
        """
        damping = DAMPING if np.ptp(scene.masses) < MANY_TIMES_HEAVIER * scene.masses.min() else DAMPING_OF_A_STACK
        return Settings(step or STEP, {"inv_damping": damping, "contacts found by": "our detection"},
                        "computes only the impact; our code finds contacts and steps time, and passes the approaching "
                        "contacts as equalities")  # fmt: skip

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with semi-implicit steps; touching, approaching rows are resolved at once at the start of a step."""
        pinocchio, damping = self.engine(), float(settings.options["inv_damping"])
        system = System(own_scene(scene, step, duration))
        q, v = (part.copy() for part in system.start)
        model = model_of(system.mechanism).model
        model.gravity.linear = np.array(scene.gravity)
        memory, nothing = model.createData(), np.zeros(model.nv)
        record, stride = Samples(), steps_between_samples(step)
        for k in range(round(duration / step)):
            v = v + step * pinocchio.aba(model, memory, q, v, nothing)
            found = find_rows(system, q, v, 0.0)
            rows = found.jacobian[found.gamma < -APPROACHES]
            if len(rows):
                v = np.array(pinocchio.impulseDynamics(model, memory, q, v, rows, scene.restitution, damping))
            if k % stride == 0:
                record.add(k * step, *world_state(q, v))
            q = pinocchio.integrate(model, q, step * v)
        record.add(duration, *world_state(q, v))
        return record.trajectory()
