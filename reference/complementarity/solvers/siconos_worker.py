"""Program for the system's Python: solve contact problems from standard input with Siconos until the input ends.

A request is a line of JSON {kind, method, accuracy, iterations, unknowns, contacts}, then W by columns, q and mu, all
doubles. An answer is a line of JSON {status, iterations, seconds}, then the impulse; seconds are those of the solver.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from typing import Any, BinaryIO

import numpy as np


def main() -> None:
    """Answer requests until standard input ends."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # Siconos prints to standard output, which carries our answers
    numerics = importlib.import_module("siconos.numerics")
    answers.write(b"ready\n")
    answers.flush()
    while line := requests.readline():
        _serve(json.loads(line), requests, answers, numerics)


def _serve(asked: dict[str, Any], requests: BinaryIO, answers: BinaryIO, numerics: Any) -> None:
    n, contacts = asked["unknowns"], asked["contacts"]
    matrix = _read(requests, n * n).reshape((n, n), order="F")
    offset, friction = _read(requests, n), _read(requests, contacts)
    options = numerics.SolverOptions(getattr(numerics, asked["method"]))
    options.dparam[numerics.SICONOS_DPARAM_TOL] = asked["accuracy"]
    options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = asked["iterations"]
    impulse, velocity = np.zeros(n), np.zeros(n)
    if asked["kind"] == "friction":
        problem = numerics.FrictionContactProblem(3, contacts, matrix, offset, friction)
        driver, arguments = numerics.fc3d_driver, (problem, impulse, velocity, options)
    else:
        problem = numerics.LCP(matrix, offset)
        driver, arguments = numerics.linearComplementarity_driver, (problem, impulse, velocity, options)
    started = time.perf_counter()
    status = driver(*arguments)
    seconds = time.perf_counter() - started
    done = int(options.iparam[numerics.SICONOS_IPARAM_ITER_DONE])
    answers.write(json.dumps({"status": int(status), "iterations": done, "seconds": seconds}).encode() + b"\n")
    answers.write(impulse.tobytes())
    answers.flush()


def _read(requests: BinaryIO, count: int) -> np.ndarray:
    return np.frombuffer(requests.read(8 * count), dtype=np.float64).copy()


if __name__ == "__main__":
    main()
