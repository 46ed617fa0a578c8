"""No scene of a user's kind gains energy without a warning: boxes, circles, balls, floors, slopes, stacks, linkages."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iapb.advice.checks import check_scene
from iapb.run import Run
from iapb.scene import Scene, SpatialScene, find_scene, load_scene
from iapb.simulation import simulate

GAIN = 0.03  # share of the energy at hand that counts as gained: beyond what the checks allow a first-order step


def user_scene(rng: np.random.Generator) -> Scene:
    """Return a random scene of 0.4 s, of one of five kinds."""
    kind = rng.choice(["scattered", "stack", "slope", "balls", "linkage"])
    rate = float(np.round(10.0 ** rng.uniform(2.0, 4.0)))
    contact = {"forces": "paper",
               "stiffness": float(10.0 ** rng.uniform(2.0, 9.0)), "friction": float(rng.uniform(0.0, 2.0)),
               "restitution": float(rng.choice([0.0, 0.0, 0.5, 0.9])),
               "friction_law": str(rng.choice(["coulomb", "coulomb", "regularised"]))}
    if rng.random() < 0.5:
        contact["damping"] = float(10.0 ** rng.uniform(0.0, 3.0))
    given = {"name": f"{kind}_{rng.integers(10**6)}", "rate": rate, "duration": 0.4, "contact": contact}
    return {"balls": _balls, "linkage": _linkage}.get(str(kind), _flat)(rng, str(kind), given)


def _flat(rng: np.random.Generator, kind: str, given: dict[str, Any]) -> Scene:
    """Boxes and circles on a floor, apart or on each other, or on a slope: gravity turns instead of the floor."""
    tilt = math.radians(rng.uniform(5.0, 40.0)) if kind == "slope" else 0.0
    count, height, bodies = int(rng.integers(1, 6)), 0.0, []
    lift = float(rng.choice([0.0, 0.0, rng.uniform(0.0, 0.3)]))
    for i in range(count):
        size, mass = float(rng.uniform(0.03, 0.3)), float(10.0 ** rng.uniform(-1.0, 1.0))
        round_ = rng.random() < 0.3 and kind != "stack"
        shape = {"kind": "circle", "radius": size / 2} if round_ else {"kind": "box", "size": [size, size]}
        place = [0.0, height + size / 2 + lift, 0.0] if kind == "stack" else [0.5 * i, size / 2 + lift, 0.0]
        height += size
        bodies.append({"name": f"b{i}", "joint": "planar", "mass": mass, "shapes": [shape], "position": place,
                       "inertia": mass * size**2 / (8.0 if round_ else 6.0),
                       "velocity": [0.0, 0.0, 0.0] if kind == "stack" else [float(rng.uniform(-1.0, 1.0)), 0.0, 0.0]})
    walls = [{"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}]
    gravity = [9.81 * math.sin(tilt), -9.81 * math.cos(tilt)]
    return Scene.model_validate(given | {"gravity": gravity, "bodies": bodies, "walls": walls})


def _balls(rng: np.random.Generator, kind: str, given: dict[str, Any]) -> Scene:
    """Balls and boxes in space on a floor."""
    bodies, lift = [], float(rng.choice([0.0, rng.uniform(0.0, 0.3)]))
    for i in range(int(rng.integers(1, 4))):
        size, mass, ball = float(rng.uniform(0.03, 0.3)), float(10.0 ** rng.uniform(-1.0, 1.0)), rng.random() < 0.6
        shape = {"kind": "sphere", "radius": size / 2} if ball else {"kind": "box", "size": [size] * 3}
        bodies.append({"name": f"b{i}", "joint": "free_flyer", "mass": mass, "shapes": [shape],
                       "inertia": [mass * size**2 / (10.0 if ball else 6.0)] * 3,
                       "position": [0.5 * i, 0.0, size / 2 + lift, 0, 0, 0, 1],
                       "velocity": [float(x) for x in rng.uniform(-1.0, 1.0, 2)] + [0.0] * 4})
    walls = [{"name": "floor", "kind": "half_space", "point": [0, 0, 0], "normal": [0, 0, 1]}]
    return SpatialScene.model_validate(
        given | {"dimensions": 3, "gravity": [0, 0, -9.81], "bodies": bodies, "walls": walls})


def _linkage(rng: np.random.Generator, kind: str, given: dict[str, Any]) -> Scene:
    """A chain of links that swings down to a floor, or hangs above it."""
    count, bodies, parent = int(rng.integers(1, 4)), [], "world"
    lengths = rng.uniform(0.1, 0.4, count)
    for i, length in enumerate(lengths.tolist()):
        mass = float(10.0 ** rng.uniform(-1.0, 0.5))
        origin = [0.0, float(rng.uniform(0.1, 1.2) * lengths.sum())] if i == 0 else [float(lengths[i - 1]), 0.0]
        bodies.append({"name": f"l{i}", "parent": parent, "joint": "revolute", "mass": mass, "origin": origin,
                       "inertia": mass * length**2 / 12.0, "center_of_mass": [length / 2, 0.0],
                       "shapes": [{"kind": "box", "size": [0.9 * length, 0.03], "center": [length / 2, 0.0]}],
                       "position": [float(rng.uniform(-0.3, 0.8)) if i == 0 else float(rng.uniform(-0.5, 0.5))]})
        parent = f"l{i}"
    walls = [{"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}]
    return Scene.model_validate(given | {"gravity": [0, -9.81], "bodies": bodies, "walls": walls})


def gained(run: Run) -> bool:
    """Whether a run ends with more energy than start and work: summed here anew, from the states and the ledger."""
    energy = run.energy
    first = run.contacts.gap[: int(run.contacts.offsets[1])]
    stored = 0.5 * run.scene_resolved["contact"]["stiffness"] * float(np.sum(np.minimum(first, 0.0) ** 2))
    start, end = (float(energy["kinetic"][i] + energy["potential"][i]) for i in (0, -1))
    at_hand = float(energy["kinetic"][0]) + stored + float(energy["potential"][0] - energy["potential"].min())
    weight = 9.81 * sum(body["mass"] for body in run.scene_resolved["bodies"])
    return end - start - stored > GAIN * at_hand + 1e-3 * 0.3 * weight


@pytest.mark.parametrize("seed", range(1000, 1030))
def test_what_gains_energy_is_warned_of(seed: int) -> None:
    scene = user_scene(np.random.default_rng(seed))
    run = simulate(scene, steps=min(scene.steps, 400))
    assert check_scene(scene) or run.distrust or not run.complete or not gained(run)


def test_a_gain_is_seen() -> None:
    run = simulate(load_scene(find_scene("sliding_box")), steps=50)
    assert not gained(run)
    assert gained(replace(run, energy=run.energy | {"kinetic": run.energy["kinetic"] + np.linspace(0, 9, 51)}))
