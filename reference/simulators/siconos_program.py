"""Simulate one scene with Siconos: a program for the system's Python without this project's code, from JSON to JSON.

It uses Moreau-Jean steps with theta, Siconos' interface to Bullet's contact detection without margins, and a
frictionless impact law solved by nonsmooth Gauss-Seidel. Siconos prints to standard output, so the answer is written to
the file of the last argument.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
import siconos.kernel as sk  # type: ignore[import-not-found]
import siconos.numerics as sn  # type: ignore[import-not-found]
from siconos.mechanics.collision import (  # type: ignore[import-not-found]
    RigidBodyDS,
    SiconosBox,
    SiconosContactor,
    SiconosContactorSet,
    SiconosSphere,
)
from siconos.mechanics.collision.bullet import (  # type: ignore[import-not-found]
    SiconosBulletCollisionManager,
    SiconosBulletOptions,
)


def shape_of(given: Any) -> Any:
    """Return a ball or a box without margins."""
    shape = SiconosSphere(given["radius"]) if "radius" in given else SiconosBox(*given["size"])
    shape.setInsideMargin(0.0)
    shape.setOutsideMargin(0.0)
    return shape


def contactors(shapes: Any, kept: list[Any]) -> Any:
    """Return the contactor set of shapes at their centres; `kept` keeps objects alive that Siconos only refers to."""
    made = SiconosContactorSet()
    for given in shapes:
        shape = shape_of(given)
        contactor = SiconosContactor(shape, [*given["center"], 1.0, 0.0, 0.0, 0.0])
        made.append(contactor)
        kept += [shape, contactor]
    kept.append(made)
    return made


def pose(position: Any, orientation: Any) -> list[float]:
    """Return the pose as position x, y, z and quaternion w, x, y, z."""
    x, y, z, w = orientation
    return [*position, w, x, y, z]


def body_of(given: Any, gravity: Any, kept: list[Any]) -> Any:
    """Return a rigid body under gravity; the spin is given in body axes."""
    made = RigidBodyDS(pose(given["position"], given["orientation"]), [*given["velocity"], *given["local_spin"]],
                       given["mass"], np.diag(given["inertia"]))
    made.setContactors(contactors(given["shapes"], kept))
    weight = given["mass"] * np.array(gravity)
    made.setFExtPtr(weight)
    kept.append(weight)
    return made


def simulation_of(task: Any, model: Any, kept: list[Any]) -> Any:
    """Return the time-stepping simulation with integrator and collision manager, and its solver."""
    options = SiconosBulletOptions()
    options.contactBreakingThreshold = task["contactBreakingThreshold"]
    options.minimumPointsPerturbationThreshold = int(task["minimumPointsPerturbationThreshold"])
    manager = SiconosBulletCollisionManager(options)
    manager.insertNonSmoothLaw(sk.NewtonImpactFrictionNSL(task["restitution"], 0.0, 0.0, 3), 0, 0)
    for wall in task["obstacles"]:
        box = contactors([{"size": wall["size"], "center": [0.0, 0.0, 0.0]}], kept)
        manager.insertStaticContactorSet(box, pose(wall["center"], wall["orientation"]))
    solver = sk.FrictionContact(3, sn.SICONOS_FRICTION_3D_NSGS)
    solver.numericsSolverOptions().iparam[sn.SICONOS_IPARAM_MAX_ITER] = int(task["iterations"])
    solver.numericsSolverOptions().dparam[sn.SICONOS_DPARAM_TOL] = task["tolerance"]
    simulation = sk.TimeStepping(model, sk.TimeDiscretisation(0.0, task["step"]))
    integrator = sk.MoreauJeanOSI(task["theta"])
    simulation.insertIntegrator(integrator)
    simulation.insertNonSmoothProblem(solver)
    simulation.insertInteractionManager(manager)
    simulation.setNewtonOptions(sk.SICONOS_TS_LINEAR)
    simulation.setNewtonMaxIteration(1)
    kept += [options, manager, solver, integrator]
    return simulation, solver


def simulate(task: Any) -> dict[str, Any]:
    """Return the samples [time, contacts, [[q, twist] per body]] and the largest residual of the solver."""
    kept: list[Any] = []
    model = sk.NonSmoothDynamicalSystem(0.0, task["duration"])
    bodies = [body_of(given, task["gravity"], kept) for given in task["bodies"]]
    for body in bodies:
        model.insertDynamicalSystem(body)
    simulation, solver = simulation_of(task, model, kept)
    samples: list[Any] = []
    worst, steps, last = 0.0, 0, round(task["duration"] / task["step"])

    def sample(contacts: int) -> None:
        states = [[body.q().tolist(), body.twist().tolist()] for body in bodies]
        samples.append([steps * task["step"], contacts, states])

    sample(0)
    while simulation.hasNextEvent() and steps < last:
        simulation.computeOneStep()
        simulation.nextStep()
        steps += 1
        size = int(solver.getSizeOutput()) // 3
        if size:
            worst = max(worst, float(solver.numericsSolverOptions().dparam[sn.SICONOS_DPARAM_RESIDU]))
        if steps % task["stride"] == 0 or steps == last:
            sample(size)
    return {"samples": samples, "residual": worst}


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        answer = simulate(json.load(file))
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        json.dump(answer, file)
