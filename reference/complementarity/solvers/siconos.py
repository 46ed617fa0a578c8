"""Siconos (INRIA), through the system's Python: Lemke, nonsmooth Gauss-Seidel, Alart-Curnier Newton.

Siconos is a package of the system's Python, not of this environment. One process of the system's Python solves all
problems. The reported time is that of the solver alone, without data transfer. If the process dies or does not answer
in time, the solve has failed, and the next problem gets a new process.
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
from numpy.typing import NDArray

from iapb.errors import MissingDependencyError, SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

Floats = NDArray[np.float64]

SYSTEM_PYTHON = "/usr/bin/python3"
INSTALL = "apt-get install python3-siconos"
_METHODS = {
    "LEMKE": "SICONOS_LCP_LEMKE", "NSGS": "SICONOS_FRICTION_3D_NSGS", "NSN_AC": "SICONOS_FRICTION_3D_NSN_AC",
}  # fmt: skip
_ACCURACY = 1e-12  # requested at unit W and b
_ITERATIONS = 20_000
_LONGEST = 120.0  # longest time of an answer [s]; the largest stored problems take a few seconds


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by `method` ("LEMKE", "NSGS" or "NSN_AC"), whose residuals show whether it converged.

    Raises
    ------
    MissingDependencyError
        when the system's Python has no Siconos
    """
    frictional = problem.friction is not None
    if frictional and (problem.contact_size != 3 or problem.relaxed):
        raise SolverError("refused: takes Coulomb's law on contacts of three components only")
    inertia, speed = float(np.abs(problem.delassus).max(initial=0.0)) or 1.0, velocity_scale(problem)
    asked = {"kind": "friction" if frictional else "lcp", "method": _METHODS[method], "accuracy": _ACCURACY,
             "iterations": _ITERATIONS, "unknowns": problem.size, "contacts": problem.contacts}  # fmt: skip
    said, impulse = _process().ask(asked, problem.delassus / inertia, problem.offset / speed, problem.friction_or_zero)
    note = f"{method}: status {said['status']} after {said['iterations']} iterations"
    return Answer(impulse * speed / inertia, note, seconds=float(said["seconds"]))


def start() -> None:
    """Start the process unless it runs already, so that its imports do not count as a solver's time.

    Raises
    ------
    MissingDependencyError
        when the system's Python has no Siconos
    """
    _process()


class _Worker:
    """The solver process with its pipes."""

    def __init__(self) -> None:
        script = Path(__file__).with_name("siconos_worker.py")
        self.process = subprocess.Popen(
            [SYSTEM_PYTHON, "-I", str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self.to, self.of = cast(BinaryIO, self.process.stdin), cast(BinaryIO, self.process.stdout)

    def ask(self, asked: dict[str, Any], *arrays: Floats) -> tuple[dict[str, Any], Floats]:
        """Send one problem and return its answer."""
        try:
            self.to.write(json.dumps(asked).encode() + b"\n")
            for array in arrays:
                self.to.write(array.tobytes(order="F"))
            self.to.flush()
            said = json.loads(self.line())
            return said, np.frombuffer(self.of.read(8 * asked["unknowns"])).copy()
        except (OSError, ValueError) as error:
            self.end()
            raise SolverError(f"Siconos ended without an answer: {error}") from error

    def line(self) -> bytes:
        """Return the next line; raise ValueError if none arrives in time."""
        ready, _, _ = select.select([self.of], [], [], _LONGEST)
        line = self.of.readline() if ready else b""
        if not line:
            raise ValueError(f"no answer within {_LONGEST:g} s" if not ready else "its process ended")
        return line

    def end(self) -> None:
        """Stop the process."""
        self.process.kill()
        self.process.wait()

    @property
    def alive(self) -> bool:
        """Whether the process still runs."""
        return self.process.poll() is None


_running: list[_Worker] = []


def _process() -> _Worker:
    """Return the running process, or start a new one."""
    if _running and _running[0].alive:
        return _running[0]
    _running.clear()
    try:
        worker = _Worker()
    except OSError as error:
        raise MissingDependencyError("siconos", f"{SYSTEM_PYTHON} and its Siconos", INSTALL) from error
    try:
        worker.line()
    except ValueError as error:
        worker.end()
        raise MissingDependencyError("siconos", f"a solver of Siconos in {SYSTEM_PYTHON}", INSTALL) from error
    _running.append(worker)
    atexit.register(worker.end)
    return worker
