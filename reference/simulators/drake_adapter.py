"""Drake: compliant point contacts, with an error-controlled integrator for impacts or the discrete solver."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from reference.simulators.scene import FixedScene, Obstacle, RigidBody, Sphere
from reference.simulators.simulator import Settings, Simulator, viscous_dissipation_for
from reference.simulators.trajectory import SAMPLE_INTERVAL, Samples, Trajectory

STEP = 1e-3  # [s] its default for discrete plants
NO_RESTITUTION = "no coefficient e: a stiffness and, for e < 1, Hunt and Crossley's damping at the known speed stand in"
DISSIPATES = "no coefficient e, and discrete steps dissipate even undamped contacts"
# Radius [m] of the small balls inside a box's corners; faces would have only one contact point. Near the edge of a
# face, a ball with more overlap than its radius is pushed out sideways, so balls under a heavy load are larger.
CORNER, LOADED_CORNER = 1e-3, 2e-2
OWN_STIFFNESS = 1e7  # [N/m] the half period is 1 ms with 1 kg
# [N/m] at 1 ms, by scene, without damping: the smallest error of 1e2 to 1e6 in steps of 10^(1/4)
GIVEN_STIFFNESS = {"elastic_cradle": 1e3, "bernoulli": 10.0**3.25, "two_balls_and_a_wall": 10.0**3.75,
                   "box_on_four_corners": 1e5, "box_on_sixteen_corners": 10.0**2.25,
                   "redundant_wedge": 10.0**3.5}  # fmt: skip
OTHER_STIFFNESS = 1e4
DISCRETE, CONTINUOUS = "discrete (SAP)", "continuous (runge_kutta3)"


class Drake(Simulator):
    """Adapter to a MultibodyPlant."""

    title, module, package = "Drake", "pydrake.all", "drake"

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return the discrete defaults for resting scenes. Impact scenes get a given contact stiffness.

        Without a given step, impacts are integrated with error control and with damping for e < 1; with a given step,
        by the discrete solver without damping.
        """
        corner = LOADED_CORNER if scene.rests and len(scene.bodies) > 1 else CORNER
        if scene.rests:
            return Settings(step or STEP, {"mode": DISCRETE, "material": "default", "corner radius": corner})
        if step is None:
            lossy = viscous_dissipation_for(scene.restitution, scene.fastest)
            given: dict[str, str | float] = {
                "mode": CONTINUOUS, "accuracy": 1e-8, "point_contact_stiffness": OWN_STIFFNESS,
                "hunt_crossley_dissipation": lossy, "corner radius": corner}  # fmt: skip
            return Settings(STEP, given, NO_RESTITUTION)
        stiffness = GIVEN_STIFFNESS.get(scene.name, OTHER_STIFFNESS)
        return Settings(step, {"mode": DISCRETE, "point_contact_stiffness": stiffness, "relaxation_time": 0.0,
                               "sap_near_rigid_threshold": 0.0, "corner radius": corner}, DISSIPATES)  # fmt: skip

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate with `Simulator.AdvanceTo`."""
        drake, given = self.engine(), settings.options
        plant, diagram, bodies = _build(drake, scene, settings, step)
        simulator = drake.Simulator(diagram)
        if given["mode"] == CONTINUOUS:
            drake.ApplySimulatorConfig(drake.SimulatorConfig(integration_scheme="runge_kutta3", max_step_size=step,
                                                             accuracy=given["accuracy"]), simulator)  # fmt: skip
        context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
        for body, made in zip(scene.bodies, bodies, strict=True):
            plant.SetFreeBodyPose(context, made, _pose(drake, body))
            plant.SetFreeBodySpatialVelocity(context, made, drake.SpatialVelocity(body.spin, body.velocity))
        simulator.Initialize()
        record, interval = Samples(), max(step, SAMPLE_INTERVAL)
        for k in range(round(duration / interval) + 1):
            simulator.AdvanceTo(k * interval)
            places = [plant.EvalBodyPoseInWorld(context, body) for body in bodies]
            speeds = [plant.EvalBodySpatialVelocityInWorld(context, body) for body in bodies]
            wxyz = np.array([place.rotation().ToQuaternion().wxyz() for place in places])
            record.add(k * interval, [place.translation() for place in places], wxyz[:, [1, 2, 3, 0]],
                       [speed.translational() for speed in speeds], [speed.rotational() for speed in speeds])
        return record.trajectory()


def _build(drake: Any, scene: FixedScene, settings: Settings, step: float) -> tuple[Any, Any, list[Any]]:
    """Return plant, diagram and bodies; a frictionless contact has two equal springs in series."""
    builder, bodies, given = drake.DiagramBuilder(), list[Any](), settings.options
    plant, geometry = drake.AddMultibodyPlantSceneGraph(builder, 0.0 if given["mode"] == CONTINUOUS else step)
    if given["mode"] == DISCRETE:
        plant.set_discrete_contact_approximation(drake.DiscreteContactApproximation.kSap)
    if "sap_near_rigid_threshold" in given:
        plant.set_sap_near_rigid_threshold(given["sap_near_rigid_threshold"])
    plant.mutable_gravity_field().set_gravity_vector(scene.gravity)
    material, stiffness = drake.ProximityProperties(), 2.0 * float(given.get("point_contact_stiffness", 0.0))
    drake.AddContactMaterial(given.get("hunt_crossley_dissipation"), stiffness or None,
                             drake.CoulombFriction(0.0, 0.0), material)  # fmt: skip
    if "relaxation_time" in given:
        material.AddProperty("material", "relaxation_time", given["relaxation_time"])
    for wall in scene.obstacles:
        box, place = drake.Box(*wall.size), _pose(drake, wall)
        plant.RegisterCollisionGeometry(plant.world_body(), place, box, wall.name, material)
    balls, boxes, radius = drake.GeometrySet(), drake.GeometrySet(), float(given["corner radius"])
    for body in scene.bodies:
        inertia = drake.UnitInertia(*(moment / body.mass for moment in body.inertia))
        bodies.append(plant.AddRigidBody(body.name, drake.SpatialInertia(body.mass, np.zeros(3), inertia)))
        for number, shape in enumerate(body.shapes):
            center, parts = np.array(shape.center), list[Any]()
            if isinstance(shape, Sphere):
                parts = [(drake.Sphere(shape.radius), center, drake.GeometrySet())]
            else:  # small balls at the corners and, if there are other bodies, also faces
                reach = 0.5 * np.array(shape.size) - radius
                parts = [(drake.Sphere(radius), center + reach * sign, balls) for sign in product((-1, 1), repeat=3)]
                parts += [(drake.Box(*shape.size), center, boxes)] * (len(scene.bodies) > 1)
            for k, (part, middle, group) in enumerate(parts):
                group.Add(plant.RegisterCollisionGeometry(bodies[-1], drake.RigidTransform(middle), part,
                                                          f"{body.name} {number} {k}", material))  # fmt: skip
    plant.Finalize()
    rules = drake.CollisionFilterDeclaration().ExcludeWithin(balls).ExcludeWithin(boxes)
    geometry.collision_filter_manager().Apply(rules)  # of a box, only corners and faces collide
    return plant, builder.Build(), bodies


def _pose(drake: Any, body: RigidBody | Obstacle) -> Any:
    x, y, z, w = body.orientation
    return drake.RigidTransform(drake.Quaternion(w, x, y, z), body.position)
