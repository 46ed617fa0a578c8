"""Resting contact: implicit forces make no energy at any stiffness, Coulomb's friction sticks,
slides, dissipates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.contact.laws import Penalty
from iapb.run import Run
from iapb.scene import Scene
from iapb.simulation import simulate
from iapb.system import System
from tests.iapb.contact import paper
from tests.iapb.contact.paper import scene_of

FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}


def sliders(seed: int, count: int | None = None, **contact: Any) -> Scene:
    """Balls on a slide between two walls, some overlapping: K to 1e9, 100 Hz to 10 kHz, masses over
    8 decades.

    They move by about 1 mm in a step: faster ones could pass through each other, and their gaps
    would not be linear.
    """
    rng = np.random.default_rng(seed)
    count = count or int(rng.integers(1, 9))
    rate = float(10.0 ** rng.uniform(2.0, 4.0))
    places = np.cumsum(rng.uniform(0.0185, 0.0215, count))
    bodies = [
        {
            "name": f"ball_{k}",
            "joint": "prismatic",
            "axis": [1, 0],
            "mass": float(10.0 ** rng.uniform(-5.0, 3.0)),
            "shapes": [{"kind": "circle", "radius": 0.01}],
            "position": [float(x)],
            "velocity": [float(rng.normal(scale=min(1.0, 1e-3 * rate)))],
        }
        for k, x in enumerate(places)
    ]
    walls = [
        {
            "name": f"wall_{side}",
            "kind": "half_plane",
            "normal": [-side, 0],
            "point": [places[0 if side < 0 else -1] + side * (0.01 + rng.uniform(-1e-3, 1e-3)), 0],
        }
        for side in (-1, 1)
    ]
    given = {
        "stiffness": float(10.0 ** rng.uniform(0.0, 9.0)),
        "damping": float(rng.choice([0.0, 10.0 ** rng.uniform(-2.0, 6.0)])),
    }
    return scene_of(bodies, walls, rate=rate, duration=60.0 / rate, contact=given | contact)


def made(run: Run) -> tuple[float, float]:
    """Return the largest gain of a step, and of the kinetic energy since the start, as shares of
    the energy there.

    The gain of a step counts the springs of the contacts at its start alone: a contact found late,
    inside a wall, has an energy that no step has made. Rounding of the gaps, 1e-16 m of 0.1 m,
    times K is taken off.
    """
    K = run.scene_resolved["contact"]["stiffness"]
    table = run.contacts
    kinetic = run.energy["kinetic"]
    pair = list(
        zip(
            table.body_a.tolist(),
            table.body_b.tolist(),
            np.sign(table.normal[:, 0]).tolist(),
            strict=True,
        )
    )
    gaps = [
        {
            pair[i]: min(float(table.gap[i]), 0.0)
            for i in range(table.offsets[k], table.offsets[k + 1])
        }
        for k in range(run.steps)
    ]
    first = kinetic[0] + 0.5 * K * sum(gap**2 for gap in gaps[0].values())
    step = 0.0
    for k, (now, then) in enumerate(zip(gaps[:-1], gaps[1:], strict=True)):
        before = kinetic[k] + 0.5 * K * sum(gap**2 for gap in now.values())
        after = kinetic[k + 1] + 0.5 * K * sum(then.get(pair, 0.0) ** 2 for pair in now)
        noise = K * 1e-16 * sum(abs(gap) for gap in now.values())
        step = max(step, (after - before - noise) / max(before, 1e-300))
    return step, float(kinetic.max() / first - 1.0)


@pytest.mark.parametrize("seed", range(60))
def test_no_stiffness_rate_or_mass_makes_energy_where_gaps_are_linear(seed: int) -> None:
    run = simulate(sliders(seed), Penalty())
    step, start = made(run)
    assert run.complete and step < 1e-9
    assert (
        start < 1e-9 or run.distrust
    )  # a light ball squeezed through a heavy one: its gap is not linear


def test_explicit_springs_do_make_energy_there() -> None:
    """What the test above must see: the wrong twin of the theorem."""
    runs = [simulate(sliders(seed, 3, forces="paper"), Penalty()) for seed in range(20)]
    assert sum(not run.complete or max(made(run)) > 1e-3 for run in runs) > 10


@pytest.mark.parametrize("seed", range(20))
def test_implicit_forces_solve_the_complementarity_problem(seed: int) -> None:
    """0 <= p ⟂ γ⁺ + (p/Δt + K φ)/(K Δt + B) >= 0 in a tower of boxes over nine decades of stiffness
    and of mass.

    In the first step: later ones know how the gaps bend (tests/iapb/contact/test_steps.py).
    """
    rng = np.random.default_rng(100 + seed)
    bodies = [
        {
            "name": f"box_{k}",
            "joint": "planar",
            "mass": float(10.0 ** rng.uniform(-2, 2)),
            "inertia": 1e-2,
            "shapes": [{"kind": "box", "size": [0.1, 0.1]}],
            "position": [0.04 * float(rng.uniform(-1, 1)) * k, 0.05 - 1e-4 + (0.1 - 1e-4) * k, 0.0],
        }
        for k in range(4)
    ]
    scene = scene_of(
        bodies,
        [FLOOR],
        gravity=[0.3, -9.81],
        duration=0.01,
        integrator="semi_implicit_euler",
        contact={
            "stiffness": float(10.0 ** rng.uniform(2, 8)),
            "damping": float(10.0 ** rng.uniform(0, 4)),
        },
    )
    run = simulate(scene, Penalty())
    system = System(scene)
    h = 1e-3
    K = scene.contact.stiffness
    k = K * h + scene.contact.damping
    some = 0
    for c, p in zip(paper.contacts_of(system, run.q[0]), run.contacts.normal_force, strict=False):
        row = c.normal @ paper.relative_jacobian(system.mechanism, run.q[0], c)
        size = np.abs(row) @ np.abs(run.v[1]) + K * abs(c.gap) / k
        opened = row @ run.v[1] + (p + K * c.gap) / k
        assert p >= 0.0 and opened >= -1e-7 * size
        assert p == 0.0 or opened <= 1e-7 * size
        some += p > 0.0
    assert some > 4
