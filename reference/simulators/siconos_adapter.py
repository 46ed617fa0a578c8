"""Siconos: Moreau-Jean time stepping with Newton's impact law, in a process of the system's Python."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from iapb.errors import IapbError, MissingDependencyError, SolverError
from reference.siconos_bridge import INSTALL, ask
from reference.simulators.scene import FixedScene, rotation
from reference.simulators.simulator import Settings, Simulator
from reference.simulators.trajectory import Samples, Trajectory, steps_between_samples

STEP = 1e-3  # [s]
# Relative residual of the solver above which a step is invalid; Siconos only prints a warning. Gauss-Seidel converges
# slowly for redundant corners at rest (1e-5); a solver that has not converged leaves 1e-1.
CONVERGED = 1e-3
# [m] of contactBreakingThreshold: the best of 2 and 20 mm at rest. At an impact a contact must end soon.
AT_REST, AT_IMPACTS = 2e-2, 2e-3


class Siconos(Simulator):
    """Adapter to siconos.kernel and siconos.mechanics."""

    title = "Siconos"

    def version(self) -> str:
        """Return the version of the Debian package, or "unknown" without one."""
        try:
            return str(ask({"do": "version"})["version"])
        except (MissingDependencyError, SolverError) as error:  # no Siconos, or one that cannot simulate
            raise MissingDependencyError("siconos", "The Siconos adapter", INSTALL) from error

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """Return theta = 1/2, which conserves energy at e = 1, and Gauss-Seidel: Lemke fails for redundant corners."""
        return Settings(step or STEP, {"theta": 0.5, "solver": "NSGS", "iterations": 1e3, "tolerance": 1e-10,
                                       "contactBreakingThreshold": AT_REST if scene.rests else AT_IMPACTS,
                                       "minimumPointsPerturbationThreshold": 3.0,
                                       "margins": 0.0})  # fmt: skip

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate in the process of `reference.siconos_bridge`."""
        bodies = [asdict(body) | {"local_spin": (rotation(body.orientation).T @ np.array(body.spin)).tolist()}
                  for body in scene.bodies]  # fmt: skip
        obstacles = [asdict(wall) | {"shapes": [asdict(shape) for shape in wall.shapes]} for wall in scene.obstacles]
        found = ask({"do": "simulate", **settings.options, "step": step, "duration": duration, "bodies": bodies,
                     "obstacles": obstacles, "stride": steps_between_samples(step), "gravity": scene.gravity,
                     "restitution": scene.restitution}, longest=None)  # fmt: skip
        if found["residual"] > CONVERGED:
            raise IapbError(f"Siconos' solver stopped with a residual of {found['residual']:.1g}")
        record = Samples()
        for time, states in found["samples"]:
            q, twist = (np.array(part, np.float64) for part in zip(*states, strict=True))
            turn = q[:, [4, 5, 6, 3]]
            spin = np.einsum("bij,bj->bi", rotation(turn), twist[:, 3:])
            record.add(time, q[:, :3], turn, twist[:, :3], spin)
        return record.trajectory()
