"""Siconos' Lemke, nonsmooth Gauss-Seidel and Alart-Curnier Newton (`reference.siconos_bridge`).

The reported time is that of the solver alone, without the transfer to its process.
"""

from __future__ import annotations

import numpy as np

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale
from reference.siconos_bridge import ask, start

__all__ = ["solve", "start"]

_METHODS = {"LEMKE": "SICONOS_LCP_LEMKE", "NSGS": "SICONOS_FRICTION_3D_NSGS", "NSN_AC": "SICONOS_FRICTION_3D_NSN_AC"}
_ACCURACY = 1e-12  # requested at unit W and b
_ITERATIONS = 20_000


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by `method` ("LEMKE", "NSGS" or "NSN_AC"), whose residuals show whether it converged."""
    frictional = problem.friction is not None
    if frictional and (problem.contact_size != 3 or problem.relaxed):
        raise SolverError("refused: takes Coulomb's law on contacts of three components only")
    inertia, speed = float(np.abs(problem.delassus).max(initial=0.0)) or 1.0, velocity_scale(problem)
    said = ask({"do": "solve", "method": _METHODS[method], "accuracy": _ACCURACY, "iterations": _ITERATIONS,
                "matrix": (problem.delassus / inertia).tolist(), "offset": (problem.offset / speed).tolist(),
                "friction": problem.friction_or_zero.tolist() if frictional else None})  # fmt: skip
    note = f"{method}: status {said['status']} after {said['iterations']} iterations"
    return Answer(np.array(said["impulse"]) * speed / inertia, note, seconds=float(said["seconds"]))
