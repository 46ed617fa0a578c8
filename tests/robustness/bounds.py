"""Run scenes with interpreted kernels, which refuse an index beyond an array: `python -m tests.robustness.bounds N`.

Compiled kernels do not check indices. The scenes are all shipped ones in the engine's worlds, and N random ones that
combine joints, couplings, renderings, devices, forces and integrators. `bounds N twice` runs each scene twice with
compiled kernels and prints both hashes: they show what a kernel reads that was never written, once processes with other
`MALLOC_PERTURB_` are compared.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "0" if sys.argv[2:] == ["twice"] else "1"
os.environ["IAPB_COMPILE"] = "whole"

import numpy as np

from iapb.contact.laws import RENDERINGS, ImpulseAugmented, Penalty
from iapb.errors import IapbError
from iapb.scene import Scene, load_scene
from iapb.scene.model import scene_kind
from iapb.simulation import simulate
from iapb.system import coupling_of
from reports.store import content_hash
from verification.laws.scenes import draw_scene, draw_spatial_scene

TWICE = sys.argv[2:] == ["twice"]
SCENES = Path(__file__).parents[2] / "scenes"
STEPS = 8
JOINTS = {True: ("continuous", "spherical", "free_flyer", "free_flyer", "prismatic", "revolute"),
          False: ("planar", "planar", "prismatic", "revolute")}  # by whether the scene is in space


def cases(count: int) -> Iterator[tuple[str, Scene, Any, str]]:
    """Yield name, scene, law and coupling."""
    for path in sorted(SCENES.glob("*.yaml")):
        scene = load_scene(path)
        struck = scene.with_values({"duration": STEPS / scene.rate})
        gains = "four-channel" if scene.couplings.four_channel else "none"
        for law in (ImpulseAugmented(), ImpulseAugmented(pushing=True), Penalty("runge_kutta_4")):
            yield scene.name, struck, law, gains
    for seed in range(count):
        yield f"seed {seed}", *drawn(np.random.default_rng(seed))


def drawn(rng: np.random.Generator) -> tuple[Scene, Any, str]:
    """Return a random scene with overlapping bodies, and a device at a joint of any kind."""
    values = dict((draw_spatial_scene if rng.random() < 0.7 else draw_scene)(rng, STEPS).values)
    forces = str(rng.choice(["implicit", "paper"]))
    values["contact"] = values["contact"] | {"forces": forces}
    values["integrator"] = str(rng.choice(["momentum", "momentum", "semi_implicit_euler", "midpoint", "runge_kutta_4"]))
    space = "dimensions" in values
    sizes = {"free_flyer": 6, "planar": 3, "spherical": 3}
    kind = str(rng.choice(JOINTS[space]))
    d = sizes.get(kind, 1)
    tool: dict[str, Any] = {"name": "tool", "joint": kind, "mass": 0.5, "velocity": [0.3] * d,
                            "inertia": [1e-3, 2e-3, 2.5e-3] if space else 1e-3, "center_of_mass": [0.01] * (2 + space),
                            "shapes": [{"kind": "sphere" if space else "circle", "radius": 0.3}]}
    if kind in ("continuous", "prismatic", "revolute"):
        axis = [0.0, 1.0, 0.0] if kind == "prismatic" or space else None
        tool |= {"axis": axis[: 2 + space]} if axis else {}
    values["bodies"] = [*values["bodies"], tool]
    values["hand"] = {"body": "tool", "force": [1.0] * (6 if space else 3)}
    gains = {"stiffness": [50.0] * d, "damping": [1.0] * d}
    values["couplings"] = {"four_channel": gains, "unilateral": gains}
    values["device"] = {"position_resolution": [1e-3] * d, "delay": int(rng.integers(0, 3)), "force_limit": [2.0] * d,
                        "damping": [0.1] * d}
    scene = scene_kind(values).model_validate(values)
    law = ImpulseAugmented(rendering=str(rng.choice(RENDERINGS))) if rng.random() < 0.7 else Penalty()
    return scene, law, str(rng.choice(["none", "four-channel", "unilateral"]))


def main(count: int) -> int:
    """Return the number of cases that ran; an IndexError ends the program."""
    warnings.simplefilter("ignore")
    done = 0
    for name, scene, law, gains in cases(count):
        try:
            runs = [simulate(scene, law, coupling_of(scene, gains), steps=STEPS) for _ in range(1 + TWICE)]
            if TWICE:
                print(name, *map(content_hash, runs), flush=True)
        except IapbError as stop:
            print(f"{name}: {stop}")
        except IndexError as error:
            raise SystemExit(f"{name}, {scene.name}: {error!r}, written out of range") from error
        done += 1
    return done


if __name__ == "__main__":
    print(f"{main(int(sys.argv[1]))} cases")
