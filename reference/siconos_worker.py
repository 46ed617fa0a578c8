"""Program for the system's Python, without this project's code: answer lines of JSON until standard input ends.

A request has "do": "version", "solve" (a contact problem) or "simulate" (a scene). Simulations use Moreau-Jean steps
with theta, Siconos' interface to Bullet's contact detection without margins, and a frictionless impact law solved by
nonsmooth Gauss-Seidel. An error is answered as {"error": text}.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from importlib import import_module
from typing import Any

import numpy as np


def main() -> None:
    """Answer requests until standard input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Siconos prints to standard output, which carries our answers
    import_module("siconos.numerics")
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        task = json.loads(line)
        try:
            answer = {"version": version, "solve": solve, "simulate": simulate}[task["do"]](task)
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


def version(task: Any) -> dict[str, Any]:
    """Return the version of the Debian package, if Siconos can simulate."""
    import_module("siconos.kernel"), import_module("siconos.mechanics.collision.bullet")
    query = ["dpkg-query", "-W", "-f", "${Version}", "python3-siconos"]
    return {"version": subprocess.run(query, capture_output=True, text=True).stdout.split("+")[0] or "unknown"}


def solve(task: Any) -> dict[str, Any]:
    """Return impulse, status, iterations and the seconds of the solver; friction is None for an LCP."""
    sn = import_module("siconos.numerics")
    matrix, offset = np.array(task["matrix"], order="F"), np.array(task["offset"])
    options = sn.SolverOptions(getattr(sn, task["method"]))
    options.dparam[sn.SICONOS_DPARAM_TOL] = task["accuracy"]
    options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = task["iterations"]
    impulse, velocity = np.zeros(len(offset)), np.zeros(len(offset))
    if task["friction"] is None:
        problem, driver = sn.LCP(matrix, offset), sn.linearComplementarity_driver
    else:
        friction = np.array(task["friction"])
        problem, driver = sn.FrictionContactProblem(3, len(friction), matrix, offset, friction), sn.fc3d_driver
    started = time.perf_counter()
    status = driver(problem, impulse, velocity, options)
    return {"seconds": time.perf_counter() - started, "impulse": impulse.tolist(), "status": int(status),
            "iterations": int(options.iparam[sn.SICONOS_IPARAM_ITER_DONE])}


def simulate(task: Any) -> dict[str, Any]:
    """Return the samples [time, [[q, twist] per body]] and the largest residual of the solver."""
    sk, sn = import_module("siconos.kernel"), import_module("siconos.numerics")
    kept: list[Any] = []  # objects that Siconos only refers to
    model = sk.NonSmoothDynamicalSystem(0.0, task["duration"])
    bodies = [_body(given, task["gravity"], kept) for given in task["bodies"]]
    for body in bodies:
        model.insertDynamicalSystem(body)
    simulation, solver = _simulation(sk, sn, task, model, kept)
    samples: list[Any] = []
    worst, steps, last = 0.0, 0, round(task["duration"] / task["step"])
    while True:
        if steps % task["stride"] == 0 or steps == last:
            states = [[body.q().tolist(), body.twist().tolist()] for body in bodies]
            samples.append([steps * task["step"], states])
        if steps == last or not simulation.hasNextEvent():
            return {"samples": samples, "residual": worst}
        simulation.computeOneStep()
        simulation.nextStep()
        steps += 1
        if solver.getSizeOutput():
            worst = max(worst, float(solver.numericsSolverOptions().dparam[sn.SICONOS_DPARAM_RESIDU]))


def _contactors(shapes: Any, kept: list[Any]) -> Any:
    """Return the set of balls and boxes, without margins, at their centres."""
    sc = import_module("siconos.mechanics.collision")
    made = sc.SiconosContactorSet()
    for given in shapes:
        shape = sc.SiconosSphere(given["radius"]) if "radius" in given else sc.SiconosBox(*given["size"])
        shape.setInsideMargin(0.0)
        shape.setOutsideMargin(0.0)
        contactor = sc.SiconosContactor(shape, [*given["center"], 1.0, 0.0, 0.0, 0.0])
        made.append(contactor)
        kept += [shape, contactor]
    kept.append(made)
    return made


def _pose(given: Any) -> list[float]:
    """Return the pose as position x, y, z and quaternion w, x, y, z."""
    x, y, z, w = given["orientation"]
    return [*given["position"], w, x, y, z]


def _body(given: Any, gravity: Any, kept: list[Any]) -> Any:
    """Return a rigid body under gravity; the spin is given in body axes."""
    made = import_module("siconos.mechanics.collision").RigidBodyDS(
        _pose(given), [*given["velocity"], *given["local_spin"]], given["mass"], np.diag(given["inertia"]))
    made.setContactors(_contactors(given["shapes"], kept))
    weight = given["mass"] * np.array(gravity)
    made.setFExtPtr(weight)
    kept.append(weight)
    return made


def _simulation(sk: Any, sn: Any, task: Any, model: Any, kept: list[Any]) -> Any:
    """Return the time-stepping simulation with integrator and collision manager, and its solver."""
    bullet = import_module("siconos.mechanics.collision.bullet")
    options = bullet.SiconosBulletOptions()
    options.contactBreakingThreshold = task["contactBreakingThreshold"]
    options.minimumPointsPerturbationThreshold = int(task["minimumPointsPerturbationThreshold"])
    manager = bullet.SiconosBulletCollisionManager(options)
    manager.insertNonSmoothLaw(sk.NewtonImpactFrictionNSL(task["restitution"], 0.0, 0.0, 3), 0, 0)
    for wall in task["obstacles"]:
        manager.insertStaticContactorSet(_contactors(wall["shapes"], kept), _pose(wall))
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


if __name__ == "__main__":
    main()
