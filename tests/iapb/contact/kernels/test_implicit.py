"""Implicit resting contact solves the complementarity problem, makes no energy, and has Coulomb's friction.

Bodies on slides have gaps that are linear over a step, so that the theorem (docs/theory.md) holds to rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.contact.kernels.implicit import STICKING, guard
from iapb.contact.laws import Penalty
from iapb.run import Run
from iapb.scene import Scene
from iapb.scene.model import scene_kind
from iapb.simulation import Simulation, simulate

FLOOR = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}


def scene(bodies: list[dict[str, Any]], walls: list[dict[str, Any]], **values: Any) -> Scene:
    given = {"name": "made", "rate": 1000.0, "duration": 0.2, "bodies": bodies, "walls": walls} | values
    return scene_kind(given).model_validate(given)


def sliders(rng: np.random.Generator, count: int) -> Scene:
    """Balls on a slide between two walls, some overlapping: K to 1e9, 100 Hz to 10 kHz, masses over 8 decades.

    They move by about 1 mm in a step: faster ones could pass through each other, and their gaps would not be linear.
    """
    rate = float(10.0 ** rng.uniform(2.0, 4.0))
    places = np.cumsum(rng.uniform(0.0185, 0.0215, count))
    bodies = [{"name": f"ball_{k}", "joint": "prismatic", "axis": [1, 0], "mass": float(10.0 ** rng.uniform(-5.0, 3.0)),
               "shapes": [{"kind": "circle", "radius": 0.01}], "position": [float(x)],
               "velocity": [float(rng.normal(scale=min(1.0, 1e-3 * rate)))]} for k, x in enumerate(places)]
    walls = [{"name": "left", "kind": "half_plane", "point": [places[0] - 0.01 - rng.uniform(-1e-3, 1e-3), 0],
              "normal": [1, 0]},
             {"name": "right", "kind": "half_plane", "point": [places[-1] + 0.01 + rng.uniform(-1e-3, 1e-3), 0],
              "normal": [-1, 0]}]
    contact = {"stiffness": float(10.0 ** rng.uniform(0.0, 9.0)),
               "damping": float(rng.choice([0.0, 10.0 ** rng.uniform(-2.0, 6.0)]))}
    return scene(bodies, walls, rate=rate, duration=60.0 / rate, contact=contact)


def made(run: Run) -> tuple[float, float]:
    """Return the largest gain of a step, and of the kinetic energy since the start, as shares of the energy there.

    The gain of a step counts the springs of the contacts at its start alone: a contact found late, inside a wall, has
    an energy that no step has made. Rounding of the gaps, 1e-16 m of 0.1 m, times K is taken off.
    """
    K, table, kinetic = run.scene_resolved["contact"]["stiffness"], run.contacts, run.energy["kinetic"]
    pair = list(zip(table.body_a.tolist(), table.body_b.tolist(), np.sign(table.normal[:, 0]).tolist(), strict=True))
    gaps = [{pair[i]: min(float(table.gap[i]), 0.0)
             for i in range(table.offsets[k], table.offsets[k + 1])} for k in range(run.steps)]
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
    rng = np.random.default_rng(seed)
    given = sliders(rng, int(rng.integers(1, 9)))
    run = simulate(given, Penalty())
    step, start = made(run)
    assert run.complete and step < 1e-9
    assert start < 1e-9 or run.distrust  # a light ball squeezed through a heavy one: its gap is not linear


def test_explicit_springs_do_make_energy_there() -> None:
    """What the test above must see: the wrong twin of the theorem."""
    found = []
    for seed in range(20):
        given = sliders(np.random.default_rng(seed), 3).with_values({"contact.forces": "paper"})
        run = simulate(given, Penalty())
        found.append(not run.complete or max(made(run)) > 1e-3)
    assert sum(found) > 10


@pytest.mark.parametrize("seed", range(20))
def test_the_answer_solves_the_complementarity_problem(seed: int) -> None:
    """0 <= p ⟂ (W + R) p + J v* + φ K/(K Δt + B) >= 0, R = 1/(Δt (K Δt + B)): recomputed from the record alone."""
    rng = np.random.default_rng(100 + seed)
    bodies = [{"name": f"box_{k}", "joint": "planar", "mass": float(10.0 ** rng.uniform(-2, 2)), "inertia": 1e-2,
               "shapes": [{"kind": "box", "size": [0.1, 0.1]}], "position": [0.04 * float(rng.uniform(-1, 1)) * k,
               0.05 - 1e-4 + (0.1 - 1e-4) * k, 0.0]} for k in range(4)]
    given = scene(bodies, [FLOOR], gravity=[0.3, -9.81], duration=0.01,
                  contact={"stiffness": float(10.0 ** rng.uniform(2, 8)), "damping": float(10.0 ** rng.uniform(0, 4))})
    simulation = Simulation(given, Penalty())
    mechanism, h, contact = simulation.system.mechanism, simulation.system.dt, given.contact
    for _ in range(10):
        q, v = simulation.state.q.copy(), simulation.state.v.copy()
        simulation.step()
        c, count = simulation.state.contacts, int(simulation.state.contact_count[0])
        rows = []
        for n, x, a, b in zip(*(each[:count] for each in (c.normal, c.point, c.body_a, c.body_b)), strict=True):
            other = mechanism.point_jacobian(q, int(b), x) if b >= 0 else 0.0
            rows.append(n @ (mechanism.point_jacobian(q, int(a), x) - other))
        if not rows:
            continue
        J, M, gap = np.array(rows), mechanism.mass_matrix(q), c.gap[:count]
        free = v + h * np.linalg.solve(M, -mechanism.gravity(q, [0.3, -9.81, 0.0]))
        p, k = h * c.normal_force[:count], contact.stiffness * h + contact.damping
        open_ = J @ free + J @ np.linalg.solve(M, J.T @ p) + p / (h * k) + gap * contact.stiffness / k
        size = np.abs(J) @ np.abs(free) + np.abs(gap) * contact.stiffness / k
        assert (p >= 0.0).all() and (open_ >= -1e-7 * size.max()).all()
        assert (np.minimum(p / max(p.max(), 1e-300), open_ / size.max()) < 1e-7).all()


def on_slope(degrees: float, mu: float, **contact: Any) -> Scene:
    a = np.radians(degrees)
    n = [float(np.sin(a)), float(np.cos(a))]
    return scene([{"name": "box", "joint": "planar", "mass": 2.0, "inertia": 3e-3,
                   "position": [0.05 * n[0], 0.05 * n[1], -a], "shapes": [{"kind": "box", "size": [0.1, 0.1]}]}],
                 [{"name": "slope", "kind": "half_plane", "point": [0, 0], "normal": n}], duration=1.0,
                 gravity=[0, -9.81], contact={"friction": mu} | contact)


def test_what_sticks_creeps_more_slowly_than_the_stated_speed_and_what_slides_has_coulombs_friction() -> None:
    sticks, slides = simulate(on_slope(20.0, 0.5)), simulate(on_slope(20.0, 0.3))
    late = sticks.q[500:]
    assert np.abs(late[-1] - late[0])[:2].max() < STICKING * 0.5 and sticks.friction_force[-1].any()
    down = 9.81 * (np.sin(np.radians(20.0)) - 0.3 * np.cos(np.radians(20.0)))
    assert np.hypot(*slides.v[-1, :2]) == pytest.approx(down, rel=2e-3)
    c = slides.contacts
    pushes = c.normal_force > 0.0
    ratio = np.linalg.norm(c.friction_force[pushes], axis=1) / c.normal_force[pushes]
    assert ratio.max() <= 0.3 * 1.002 and np.median(ratio) == pytest.approx(0.3, rel=1e-3)  # SETTLED of the limits


def test_chosen_stiffness_lets_a_stack_sag_by_less_than_a_tenth_of_a_millimetre() -> None:
    bodies = [{"name": f"box_{k}", "joint": "planar", "mass": m, "inertia": m / 600.0,
               "position": [0, 0.05 + 0.1 * k, 0], "shapes": [{"kind": "box", "size": [0.1, 0.1]}]}
              for k, m in enumerate((1e-3, 1.0, 1000.0))]
    run = simulate(scene(bodies, [FLOOR], gravity=[0, -9.81], duration=1.0))
    assert -1e-4 < run.contacts.gap.min() < 0.0 and not run.distrust
    assert "chosen for implicit contact" in run.remarks[0]


def test_an_unfinished_solution_is_shortened_until_it_makes_no_energy() -> None:
    simulation = Simulation(on_slope(20.0, 0.5), Penalty())
    for _ in range(3):
        simulation.step()
    state, world, work = simulation.state, simulation.world, simulation.state.rest_work
    work.v[:3] = 1e3 * (1.0 + np.abs(work.v[:3]))
    before = int(work.counts[1])
    guard(world, state, 3, 2, 2, False)
    kinetic = 0.5 * work.v[:3] @ state.mass_matrix @ work.v[:3]
    assert work.counts[1] == before + 1 and kinetic <= work.energy[0] * (1.0 + 1e-9) + springs_now(state, world)


def springs_now(state: Any, world: Any) -> float:
    gaps = np.minimum(state.contacts.gap[: int(state.contact_count[0])], 0.0)
    return float(0.5 * world.stiffness * (gaps @ gaps))
