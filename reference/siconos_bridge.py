"""Siconos (INRIA) in a process of the system's Python, which solves problems and simulates scenes.

Siconos is a package of the system's Python, not of this environment. One process answers all requests, one line of JSON
each. If it dies or does not answer in time, the request has failed, and the next one gets a new process. Its
solvers are Lemke, nonsmooth Gauss-Seidel and Alart-Curnier Newton; their time is without the transfer to the process.
Source: Acary and Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008); Siconos 4.
"""

from __future__ import annotations

import atexit
import json
import select
import subprocess
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from iapb.errors import MissingDependencyError, SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

SYSTEM_PYTHON = "/usr/bin/python3"
INSTALL = "apt-get install python3-siconos"
_LONGEST = 120.0  # longest time of an answer [s]; the largest stored problems take a few seconds
_METHODS = {"LEMKE": "SICONOS_LCP_LEMKE", "NSGS": "SICONOS_FRICTION_3D_NSGS", "NSN_AC": "SICONOS_FRICTION_3D_NSN_AC"}
_ACCURACY, _ITERATIONS = 1e-12, 20_000  # requested at unit W and b
_running: list[subprocess.Popen[bytes]] = []


def start() -> subprocess.Popen[bytes]:
    """Return the process, started unless it runs already, so that its imports do not count as a solver's time.

    Raises
    ------
    MissingDependencyError
        The system's Python has no Siconos.
    """
    if _running and _running[0].poll() is None:
        return _running[0]
    _running.clear()
    command = [SYSTEM_PYTHON, "-I", str(Path(__file__).with_name("siconos_worker.py"))]
    try:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        _line(process, _LONGEST)
    except (OSError, ValueError) as error:
        raise MissingDependencyError("siconos", f"Siconos in {SYSTEM_PYTHON}", INSTALL) from error
    _running.append(process)
    atexit.register(process.kill)
    return process


def ask(task: dict[str, Any], longest: float | None = _LONGEST) -> dict[str, Any]:
    """Return the answer to one request of `reference.siconos_worker`, within `longest` [s] unless None.

    Raises
    ------
    MissingDependencyError
        The system's Python has no Siconos.
    SolverError
        Siconos raises an error, its process ends, or there is no answer in time.
    """
    process = start()
    try:
        requests = cast(BinaryIO, process.stdin)
        requests.write(json.dumps(task).encode() + b"\n")
        requests.flush()
        answer: dict[str, Any] = json.loads(_line(process, longest))
    except (OSError, ValueError) as error:
        raise SolverError(f"Siconos ended without an answer: {error}") from error
    if "error" in answer:
        raise SolverError(f"Siconos stopped: {answer['error']}")
    return answer


def _line(process: subprocess.Popen[bytes], longest: float | None) -> bytes:
    """Return the process's next line; end the process and raise ValueError if none arrives in time."""
    answers = cast(BinaryIO, process.stdout)
    ready, _, _ = select.select([answers], [], [], longest)
    line = answers.readline() if ready else b""
    if not line:
        process.kill()
        process.wait()
        raise ValueError("its process ended" if ready else f"no answer within {longest:g} s")
    return line


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
