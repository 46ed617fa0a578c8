"""A contact law beside the engine's: an impulse stops every approaching contact in each step.

In the project it is a file of `reference`; `reference.contact_rows.write_contacts` records contacts.
`simulate(scene, law=...)` needs no registration. One line of `WORLDS` makes it a world by name, for
`iapb run --world impulses`. An attribute `uses` names the parts of the contact section that the law
uses (`iapb.contact.laws`).

Prints:
    impulse-augmented penalty the peg is at x = 10.340 mm, y = -5.050 mm
    impulses only the peg is at x = 10.416 mm, y = -5.208 mm
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from iapb import find_scene, resolve_impact, simulate
from iapb.contact.laws import StepResult
from iapb.run import COLLIDING, FREE
from iapb.worlds import WORLDS, World
from reference.contact_rows import find_rows


@dataclass(frozen=True)
class ImpulsesOnly:
    """No springs: an impulse stops the bodies again in each step."""

    name: str = "impulses only"
    settings: dict[str, Any] = field(default_factory=dict)

    def advance(self, system: Any, state: Any, applied_force: np.ndarray, dt: float) -> StepResult:
        """One semi-implicit step of length dt [s] from (q, v) under a constant generalised
        force."""
        mechanism, q = system.mechanism, state.q
        force = applied_force - mechanism.bias(q, state.v) - mechanism.gravity(q, system.gravity)
        mass = mechanism.mass_matrix(q)
        v = state.v + dt * np.linalg.solve(mass, force)
        rows = find_rows(system, q, v, margin=0.0)
        impact = resolve_impact(mass, rows.jacobian[rows.gamma < 0.0], v, 0.0)
        hit = COLLIDING if np.any(rows.gamma < 0.0) else FREE
        zero = np.zeros_like(v)
        return StepResult(
            mechanism.integrate(q, impact.velocity, dt),
            impact.velocity,
            zero,
            zero,
            impact.generalized_impulse,
            hit,
        )


WORLDS["impulses"] = lambda rendering: World("impulses", ImpulsesOnly(), "four-channel")

scene = find_scene("peg_corner")
for law in (None, ImpulsesOnly()):
    run = simulate(scene, law=law, steps=512)
    x, y = 1e3 * run.q[-1, :2]
    print(f"{run.law:<20} the peg is at x = {x:.3f} mm, y = {y:.3f} mm")
