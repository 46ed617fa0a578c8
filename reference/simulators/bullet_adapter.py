"""Bullet by PyBullet: sequential impulses with a coefficient of restitution."""

from __future__ import annotations

from functools import partial
from math import sqrt
from typing import Any

from reference.simulators.scene import Cuboid, FixedScene, Obstacle, RigidBody, Sphere
from reference.simulators.simulator import Settings, Simulator
from reference.simulators.trajectory import Samples, Trajectory, steps_between_samples

DEFAULT_STEP = 1.0 / 240.0  # [s]
DEFAULT_ERP = 0.2  # share of an overlap that the solver removes in a step
ITERATIONS, ITERATIONS_OF_A_STACK = 50, 10_000  # the default; for the stack the best of 50, 1000 and 10 000
_SOLVER = ("numSolverIterations", "restitutionVelocityThreshold", "erp", "contactERP", "solverResidualThreshold")
_BODY = ("linearDamping", "angularDamping", "contactProcessingThreshold")


class Bullet(Simulator):
    """Adapter to PyBullet without a window."""

    title, module, package = "Bullet", "pybullet", "pybullet"

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return Bullet's step of 1/240 s with zero thresholds and damping, which would hide restitution.

        Walls are static boxes, not planes, and each body has the restitution √e, because Bullet multiplies the two.
        Overlaps are corrected only for a single box at rest: at an impact, the default contactERP turns the overlap
        into energy, which for two balls and a wall reached 25 times the initial energy.
        """
        stacked = scene.rests and len(scene.bodies) > 1
        push_out = DEFAULT_ERP if scene.rests and not stacked else 0.0
        return Settings(step or DEFAULT_STEP, {
            "contactProcessingThreshold": 0.0, "restitutionVelocityThreshold": 0.0, "linearDamping": 0.0,
            "angularDamping": 0.0, "restitution of each body": sqrt(scene.restitution),
            "numSolverIterations": ITERATIONS_OF_A_STACK if stacked else ITERATIONS, "solverResidualThreshold": 0.0,
            "erp": push_out, "contactERP": push_out})  # fmt: skip

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with `stepSimulation`."""
        bullet = _World(self.engine())
        solver = {name: settings.options[name] for name in _SOLVER}
        bullet.setPhysicsEngineParameter(fixedTimeStep=step, numSubSteps=0, **solver)
        bullet.setGravity(*scene.gravity)
        for wall in scene.obstacles:
            _add(bullet, wall, settings.options)
        bodies = [_add(bullet, body, settings.options) for body in scene.bodies]
        record, stride, last = Samples(), steps_between_samples(step), round(duration / step)
        for k in range(last + 1):
            if k % stride == 0 or k == last:
                x, turn = zip(*map(bullet.getBasePositionAndOrientation, bodies), strict=True)
                v, spin = zip(*map(bullet.getBaseVelocity, bodies), strict=True)
                record.add(k * step, x, turn, v, spin)
            if k < last:
                bullet.stepSimulation()
        return record.trajectory()


class _World:
    """PyBullet's functions, called with the number of an own world, which ends with this object."""

    def __init__(self, module: Any) -> None:
        self.module, self.number = module, module.connect(module.DIRECT)

    def __getattr__(self, name: str) -> Any:
        return partial(getattr(self.module, name), physicsClientId=self.number)

    def __del__(self) -> None:
        self.disconnect()


def _add(bullet: Any, body: RigidBody | Obstacle, given: Any) -> int:
    """Add a body, or an obstacle as one of mass zero."""
    if isinstance(body.shapes[0], Sphere):
        shape = bullet.createCollisionShape(bullet.module.GEOM_SPHERE, radius=body.shapes[0].radius)
    else:
        boxes, kind = [box for box in body.shapes if isinstance(box, Cuboid)], bullet.module.GEOM_BOX
        halves, centers = [[0.5 * length for length in box.size] for box in boxes], [box.center for box in boxes]
        shape = bullet.createCollisionShape(kind, halfExtents=halves[0]) if len(boxes) == 1 else (
            bullet.createCollisionShapeArray([kind] * len(boxes), halfExtents=halves, collisionFramePositions=centers))
    made: int = bullet.createMultiBody(body.mass, shape, -1, body.position, body.orientation)
    bullet.changeDynamics(made, -1, restitution=given["restitution of each body"], lateralFriction=0.0,
                          rollingFriction=0.0, spinningFriction=0.0, **{name: given[name] for name in _BODY},
                          activationState=bullet.module.ACTIVATION_STATE_DISABLE_SLEEPING)  # fmt: skip
    if isinstance(body, RigidBody):
        bullet.changeDynamics(made, -1, localInertiaDiagonal=body.inertia)
        bullet.resetBaseVelocity(made, body.velocity, body.spin)
    return made
