"""What an effect costs per step: the same scene with the effect and without it, timed in turn."""

from __future__ import annotations

import statistics
from typing import Any

from iapb.errors import IapbError
from iapb.scene import Scene
from reference.worlds import find_world

# effect -> scene values that switch it off; effects without an entry belong to the scene itself
SWITCHED_OFF: dict[str, dict[str, Any]] = {
    "gravity": {"gravity": None},
    "contact_damping": {"contact.damping": 0.0},
    "friction": {"contact.friction": 0.0},
    "clustering": {"contact.cluster_distance": 0.0},
    "coherence": {"contact.coherence_distance": 0.0},
    "delay": {"device.delay": 0},
    "quantisation": {"device.position_resolution": None},
    "device_damping": {"device.damping": None},
}
_REPEATS = 9  # pairs; the medians are compared


def effect_costs(scene: Scene) -> dict[str, str]:
    """Cost of each effect that a value of the scene can switch off, as text: share of the step's time.

    Ratios of medians within one process, warm and interleaved; a clock's absolute times differ between machines.
    """
    costs = {}
    for name, values in SWITCHED_OFF.items():
        try:
            without = scene.with_values(values)
        except IapbError:  # the scene has no such section
            continue
        if without.resolved() == scene.resolved():
            continue
        with_it, without_it = [], []
        _step_seconds(scene), _step_seconds(without)
        for _ in range(_REPEATS):
            with_it.append(_step_seconds(scene))
            without_it.append(_step_seconds(without))
        share = 1.0 - statistics.median(without_it) / statistics.median(with_it)
        costs[name] = f"{100.0 * share:+.0f} % of the step ({statistics.median(with_it) * 1e6:.2f} µs with it)"
    return costs


def _step_seconds(scene: Scene) -> float:
    """Mean time of one compiled step over the scene's duration [s]."""
    from iapb.simulation import simulate

    world = find_world("IAPB")
    run = simulate(scene, world.law, world.coupling_in(scene))
    return float(run.chunk_seconds.sum() / run.steps)
