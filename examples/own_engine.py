"""An engine of one's own as a world: springs at every contact, for any scene without friction and
loss.

Run it: python examples/own_engine.py
Also, in this folder: iapb verify-world own_engine:Springs; iapb compare two_discs --worlds
own_engine:Springs,ideal
"""

from collections.abc import Callable

import numpy as np

from iapb import Run, Scene, load_scene
from iapb.engines import fields_of_our_engine, run_of_states
from iapb.scene import find_scene
from iapb.system import System


class Springs:
    """A linear spring pushes where two shapes overlap."""

    name = "springs"
    settings = {"stiffness": 1e5, "substeps": 10}  # [N/m]

    def ignored(self, scene: Scene) -> tuple[str, ...]:
        """Restitution below 1, friction, the hand, and all that is iapb's own."""
        system = System(scene)
        return (
            *fields_of_our_engine(scene),
            *["contact.restitution"] * bool(np.any(system.restitutions < 1.0)),
            *["contact.friction"] * (scene.largest_friction > 0.0),
            *["hand"] * (scene.hand is not None),
            *["bodies.joint_limits"] * any(body.joint_limits is not None for body in scene.bodies),
            *["bodies.joint_damping"] * bool(np.any(system.joint_damping)),
        )

    def run(
        self,
        scene: Scene,
        steps: int | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> Run:
        """Take ten substeps of semi-implicit Euler in each step: first v changes, then q moves by
        the new v."""
        system = System(scene)
        mechanism = system.mechanism
        substeps = self.settings["substeps"]
        dt = scene.step / substeps
        q, v = system.start
        places, rates = [q], [v]
        for _ in range(scene.steps if steps is None else steps):
            for _ in range(substeps):
                force = (
                    self.push(system, q)
                    - mechanism.bias(q, v)
                    - mechanism.gravity(q, system.gravity)
                )
                v = v + dt * np.linalg.solve(mechanism.mass_matrix(q), force)
                q = mechanism.integrate(q, v, dt)
            places.append(q)
            rates.append(v)
        return run_of_states(scene, self, np.array(places), np.array(rates))

    def push(self, system: System, q: np.ndarray) -> np.ndarray:
        """Return the generalized force of all springs: Jᵀ K s for overlaps s."""
        found = system.contacts_at(q)
        at = np.repeat(q[None], len(found.gap), axis=0)
        rows = [
            system.mechanism.rows_along(at, bodies, found.point, found.normal)
            for bodies in (found.body_a, found.body_b)
        ]
        return (rows[0] - rows[1]).T @ (-self.settings["stiffness"] * found.gap)


if __name__ == "__main__":
    scene = load_scene(find_scene("two_discs")).with_values({"contact": {"restitution": 1.0}})
    run = Springs().run(scene)
    print(run.summary)
    print("kinetic energy kept:", run.energy["kinetic"][[0, -1]].round(3))
