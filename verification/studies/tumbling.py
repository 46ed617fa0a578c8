"""A free tumbling body: drift of energy and angular momentum, and the measured order of each integrator.

The scene `tumbling_body` runs in the compiled step at a row of step lengths. Nothing acts on the body, so both must
stay: their drift is the integrator's. The order is the slope of log(drift) over log(step), and must be at least the
declared one; the attitude is compared with a run at a much finer step of the best method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from iapb.mechanics.mechanism import Mechanism
    from iapb.run import Run
    from iapb.scene import Scene

Floats = NDArray[np.float64]

RATES = (250.0, 500.0, 1000.0, 2000.0)  # [Hz]
REFERENCE_RATE = 64000.0


@dataclass(frozen=True)
class Drift:
    """One integrator at one step.

    energy, momentum : largest relative drift of the kinetic energy and of the angular momentum vector (world axes)
    attitude : angle [rad] from the reference at the end
    """

    integrator: str
    declared_order: int
    step: float
    energy: float
    momentum: float
    attitude: float


def study_tumbling(duration: float = 1.0, rates: Sequence[float] = RATES) -> tuple[Drift, ...]:
    """Return the drift of every integrator at every rate [Hz]."""
    from iapb.mechanics.integrators import INTEGRATORS
    from iapb.scene import load_scene
    from iapb.scene_files import find_scene
    from iapb.scene_mechanism import mechanism_of

    scene = load_scene(find_scene("tumbling_body")).with_values({"duration": duration})
    mechanism = mechanism_of(scene)
    end = _run(scene, "runge_kutta_4", REFERENCE_RATE).q[-1]
    found = []
    for name, method in INTEGRATORS.items():
        for rate in rates:
            run = _run(scene, name, rate)
            momentum = np.array([_angular_momentum(mechanism, q, v) for q, v in zip(run.q, run.v, strict=True)])
            length = float(np.linalg.norm(momentum[0]))
            kinetic = run.energy["kinetic"]
            found.append(Drift(
                name, method.group_order, 1.0 / rate,
                float(np.abs(kinetic / kinetic[0] - 1.0).max()),
                float(np.linalg.norm(momentum - momentum[0], axis=1).max()) / length,
                float(np.linalg.norm(mechanism.difference(end, run.q[-1])[3:])),
            ))  # fmt: skip
    return tuple(found)


def measured_order(drifts: Sequence[Drift], quantity: str) -> float:
    """Return the slope of log(quantity) over log(step) between the two finest steps."""
    coarse, fine = sorted(drifts, key=lambda drift: -drift.step)[-2:]
    ratio = getattr(coarse, quantity) / getattr(fine, quantity)
    return float(np.log(ratio) / np.log(coarse.step / fine.step))


def _run(scene: Scene, integrator: str, rate: float) -> Run:
    from iapb.contact.laws import ImpulseAugmented
    from iapb.simulation import simulate

    return simulate(scene.with_values({"rate": rate}), ImpulseAugmented(integrator))


def _angular_momentum(mechanism: Mechanism, q: Floats, v: Floats) -> Floats:
    """About the centre of mass, world axes [N m s]."""
    momentum: Floats = mechanism.centroidal_momentum(q, v)[3:]
    return momentum
