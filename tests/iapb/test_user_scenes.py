"""No random scene gains energy without a warning, whatever its stiffness and step: explicit forces,
random bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb.advice.checks import check_scene
from iapb.run import Run
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from verification.laws.scenes import draw_scene, draw_spatial_scene

# share of the energy at hand that counts as gained: beyond what the checks allow a first-order step
GAIN = 0.03


def gained(run: Run) -> bool:
    """Whether a run ends with more energy than start and work: summed here anew, from the states
    and the ledger."""
    energy = run.energy
    first = run.contacts.gap[: int(run.contacts.offsets[1])]
    stored = (
        0.5
        * run.scene_resolved["contact"]["stiffness"]
        * float(np.sum(np.minimum(first, 0.0) ** 2))
    )
    start, end = (float(energy["kinetic"][i] + energy["potential"][i]) for i in (0, -1))
    at_hand = (
        float(energy["kinetic"][0])
        + stored
        + float(energy["potential"][0] - energy["potential"].min())
    )
    weight = 9.81 * sum(body["mass"] for body in run.scene_resolved["bodies"])
    return end - start - stored > GAIN * at_hand + 1e-3 * 0.3 * weight


@pytest.mark.parametrize("seed", range(1000, 1030))
def test_what_gains_energy_is_warned_of(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = (draw_spatial_scene if seed % 3 == 0 else draw_scene)(rng).scene()
    scene = drawn.with_values(
        {
            "hand": None,
            "device": None,
            "couplings": {},
            "rate": float(10.0 ** rng.uniform(2, 4)),
            "contact.stiffness": float(10.0 ** rng.uniform(2.0, 9.0)),
        }
    )
    run = simulate(scene, steps=min(scene.steps, 400))
    assert check_scene(scene) or run.distrust or not run.complete or not gained(run)


def test_a_gain_is_seen() -> None:
    run = simulate(load_scene(find_scene("sliding_box")), steps=50)
    assert not gained(run)
    assert gained(
        replace(run, energy=run.energy | {"kinetic": run.energy["kinetic"] + np.linspace(0, 9, 51)})
    )
