"""Siconos: Moreau-Jean time stepping with Newton's impact law, in a process of the system's Python."""

from __future__ import annotations

import json
import subprocess
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from iapb.errors import IapbError, MissingDependencyError
from reference.simulators.scene import Cuboid, FixedScene, RigidBody, Sphere, rotation
from reference.simulators.simulator import Settings
from reference.simulators.trajectory import Recorder, Trajectory, steps_between_samples

STEP = 1e-3  # [s]
SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's python3-siconos is for this Python only
PROGRAM = Path(__file__).with_name("siconos_program.py")
# Relative residual of the solver above which a step is invalid; Siconos only prints a warning. Gauss-Seidel converges
# slowly for redundant corners at rest (1e-5); a solver that has not converged leaves 1e-1.
CONVERGED = 1e-3


class Siconos:
    """Adapter to siconos.kernel and siconos.mechanics."""

    title = "Siconos"

    def version(self) -> str:
        """Return the version of the Debian package, or "unknown" without one."""
        found = _version()
        if not found:
            raise MissingDependencyError("siconos", "The Siconos adapter", "apt-get install python3-siconos")
        return found

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return theta = 1/2, which conserves energy at e = 1, and Gauss-Seidel: Lemke fails for redundant corners."""
        return Settings(step or STEP, {"theta": 0.5, "solver": "NSGS", "iterations": 1e3, "tolerance": 1e-10,
                                       "contactBreakingThreshold": 2e-3, "minimumPointsPerturbationThreshold": 3.0,
                                       "margins": 0.0})  # fmt: skip

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate in a separate process."""
        self.version()
        task = _task(scene, settings, step, duration)
        with TemporaryDirectory() as folder:
            question, answer = Path(folder) / "task.json", Path(folder) / "answer.json"
            question.write_text(json.dumps(task), encoding="utf-8")
            done = subprocess.run(
                [SYSTEM_PYTHON, "-I", str(PROGRAM), str(question), str(answer)], capture_output=True, text=True
            )
            if done.returncode or not answer.exists():
                raise IapbError(f"Siconos stopped: {done.stderr.strip().splitlines()[-1:] or done.returncode}")
            found = json.loads(answer.read_text(encoding="utf-8"))
        if found["residual"] > CONVERGED:
            raise IapbError(f"Siconos' solver left a residual of {found['residual']:.1e}")
        return _trajectory(found["samples"])


@cache
def _version() -> str:
    """Return the version, or "" if Siconos cannot be imported."""
    ask = ("import siconos.kernel, siconos.mechanics.collision.bullet, subprocess\n"
           "print(subprocess.run(['dpkg-query', '-W', '-f', '${Version}', 'python3-siconos'], "
           "capture_output=True, text=True).stdout or 'unknown')")  # fmt: skip
    try:
        told = subprocess.run([SYSTEM_PYTHON, "-I", "-c", ask], capture_output=True, text=True)
    except OSError:
        return ""
    return told.stdout.strip().splitlines()[-1].split("+")[0] if told.returncode == 0 else ""


def _task(scene: FixedScene, settings: Settings, step: float, duration: float) -> dict[str, Any]:
    names = ("theta", "iterations", "tolerance", "contactBreakingThreshold", "minimumPointsPerturbationThreshold")
    return {
        **{name: settings.options[name] for name in names}, "step": step, "duration": duration,
        "stride": steps_between_samples(step), "gravity": scene.gravity, "restitution": scene.restitution,
        "bodies": [_body(body) for body in scene.bodies],
        "obstacles": [{"size": w.size, "center": w.center, "orientation": w.orientation} for w in scene.obstacles],
    }  # fmt: skip


def _body(body: RigidBody) -> dict[str, Any]:
    local = rotation(body.orientation).T @ np.array(body.spin)
    return {"position": body.position, "orientation": body.orientation, "velocity": body.velocity,
            "local_spin": local.tolist(), "mass": body.mass, "inertia": body.inertia,
            "shapes": [_shape(shape) for shape in body.shapes]}  # fmt: skip


def _shape(shape: Sphere | Cuboid) -> dict[str, Any]:
    if isinstance(shape, Sphere):
        return {"radius": shape.radius, "center": shape.center}
    return {"size": shape.size, "center": shape.center}


def _trajectory(samples: list[Any]) -> Trajectory:
    record = Recorder()
    for time, contacts, states in samples:
        q, twist = (np.array(part, np.float64) for part in zip(*states, strict=True))
        turn = q[:, [4, 5, 6, 3]]
        spin = np.einsum("bij,bj->bi", rotation(turn), twist[:, 3:])
        record.add(time, q[:, :3], turn, twist[:, :3], spin, contacts)
    return record.trajectory()
