"""Bullet by PyBullet: sequential impulses with a coefficient of restitution."""

from __future__ import annotations

from importlib.metadata import version
from math import sqrt
from typing import Any

from reference.simulators.scene import Cuboid, FixedScene, Quaternion, Sphere, Vector
from reference.simulators.simulator import Settings, engine
from reference.simulators.trajectory import Recorder, Trajectory, steps_between_samples

DEFAULT_STEP = 1.0 / 240.0  # [s]
DEFAULT_ERP = 0.2  # share of an overlap that the solver removes in a step
ITERATIONS, ITERATIONS_OF_A_STACK = 50.0, 1e4  # the default; for the stack the best of 50, 1000 and 10 000


class Bullet:
    """Adapter to PyBullet without a window."""

    title = "Bullet"

    def version(self) -> str:
        """Return the installed version."""
        engine("pybullet")
        return version("pybullet")

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return Bullet's step of 1/240 s with zero thresholds and damping, which would hide restitution.

        Walls are static boxes, not planes, and each body has the restitution √e, because Bullet multiplies the two.
        Overlaps are corrected only for a single box at rest: at an impact, the default contactERP turns the overlap
        into energy, which for two balls and a wall reached three times the initial energy.
        """
        stacked = scene.rests and len(scene.bodies) > 1
        push_out = DEFAULT_ERP if scene.rests and not stacked else 0.0
        options: dict[str, str | float] = {
            "contactProcessingThreshold": 0.0, "restitutionVelocityThreshold": 0.0, "linearDamping": 0.0,
            "angularDamping": 0.0, "restitution of each body": sqrt(scene.restitution),
            "numSolverIterations": ITERATIONS_OF_A_STACK if stacked else ITERATIONS, "solverResidualThreshold": 0.0,
            "erp": push_out, "contactERP": push_out,
        }  # fmt: skip
        return Settings(step or DEFAULT_STEP, options)

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with `stepSimulation`."""
        bullet = engine("pybullet")
        world = bullet.connect(bullet.DIRECT)
        try:
            bodies = _build(bullet, world, scene, settings, step)
            record, stride, last = Recorder(), steps_between_samples(step), round(duration / step)
            for k in range(last + 1):
                if k % stride == 0 or k == last:
                    places = (bullet.getBasePositionAndOrientation(body, physicsClientId=world) for body in bodies)
                    speeds = (bullet.getBaseVelocity(body, physicsClientId=world) for body in bodies)
                    touching = len(bullet.getContactPoints(physicsClientId=world))
                    x, turn, v, spin = (*zip(*places, strict=True), *zip(*speeds, strict=True))
                    record.add(k * step, x, turn, v, spin, touching)
                if k < last:
                    bullet.stepSimulation(physicsClientId=world)
        finally:
            bullet.disconnect(world)
        return record.trajectory()


def _build(bullet: Any, world: int, scene: FixedScene, settings: Settings, step: float) -> list[int]:
    given = settings.options
    bullet.setPhysicsEngineParameter(
        fixedTimeStep=step, numSubSteps=0, numSolverIterations=int(given["numSolverIterations"]),
        restitutionVelocityThreshold=given["restitutionVelocityThreshold"], erp=given["erp"],
        contactERP=given["contactERP"], solverResidualThreshold=given["solverResidualThreshold"], physicsClientId=world,
    )  # fmt: skip
    bullet.setGravity(*scene.gravity, physicsClientId=world)
    for wall in scene.obstacles:
        _body(bullet, world, 0.0, (Cuboid(wall.size),), wall.center, wall.orientation, given)
    bodies = []
    for body in scene.bodies:
        made = _body(bullet, world, body.mass, body.shapes, body.position, body.orientation, given)
        bullet.changeDynamics(made, -1, localInertiaDiagonal=body.inertia, physicsClientId=world)
        bullet.resetBaseVelocity(made, body.velocity, body.spin, physicsClientId=world)
        bodies.append(made)
    return bodies


def _body(bullet: Any, world: int, mass: float, shapes: tuple[Sphere | Cuboid, ...], position: Vector,
          orientation: Quaternion, given: Any) -> int:  # fmt: skip
    if isinstance(shapes[0], Sphere):
        shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=shapes[0].radius, physicsClientId=world)
    else:
        boxes = [box for box in shapes if isinstance(box, Cuboid)]
        halves, types = [[0.5 * length for length in box.size] for box in boxes], [bullet.GEOM_BOX] * len(boxes)
        if len(boxes) == 1:
            shape = bullet.createCollisionShape(types[0], halfExtents=halves[0], physicsClientId=world)
        else:
            shape = bullet.createCollisionShapeArray(shapeTypes=types, halfExtents=halves, physicsClientId=world,
                                                     collisionFramePositions=[box.center for box in boxes])  # fmt: skip
    made: int = bullet.createMultiBody(mass, shape, -1, position, orientation, physicsClientId=world)
    bullet.changeDynamics(
        made, -1, restitution=given["restitution of each body"], lateralFriction=0.0, rollingFriction=0.0,
        spinningFriction=0.0, linearDamping=given["linearDamping"], angularDamping=given["angularDamping"],
        contactProcessingThreshold=given["contactProcessingThreshold"],
        activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=world,
    )  # fmt: skip
    return made
