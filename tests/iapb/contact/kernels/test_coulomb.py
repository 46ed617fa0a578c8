"""Friction of a step by Coulomb's law: what it must be at the minimum, and what it may never do wherever it ends."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from iapb.contact.kernels.coulomb import passive_factor
from iapb.contact.kernels.step import OK, advance
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.mechanics.integrators import INTEGRATORS
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate
from iapb.system import System

MU, RATE = 0.6, 1000.0
UNSETTLED = 0.01 * 10.0 / RATE  # [m/s] 30 sweeps leave a hundredth of what gravity adds in a step, at most


def pile(masses: tuple[float, ...], law: str = "coulomb") -> Scene:
    """Balls and a box, each on others and on a tilted floor: friction of one loads the next."""
    bodies = "\n".join(
        f"  - {{name: b{k}, joint: free_flyer, mass: {m}, inertia: [{m}e-2, {2 * m}e-2, {3 * m}e-2], shapes: "
        + ("[{kind: box, size: [0.4, 0.4, 0.2]}], position: [0, 0, 0.099, 0, 0, 0, 1]}" if k == 0 else
           f"[{{kind: sphere, radius: 0.1}}], position: [{0.15 * (k - 2)}, 0.02, {0.297 + 0.05 * (k % 2)}, "
           "0, 0, 0, 1]}")
        for k, m in enumerate(masses)
    )  # fmt: skip
    return scene_from_text(f"""
name: pile
dimensions: 3
integrator: semi_implicit_euler
rate: {RATE}
duration: 0.1
gravity: [2, 1, -9.81]
bodies:
{bodies}
walls:
  - {{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}}
contact: {{forces: paper, stiffness: 2000, damping: 5, friction: {MU}, friction_law: {law}}}
""")


def stepped(scene: Scene, steps: int, v: np.ndarray) -> tuple[Any, Any, np.ndarray]:
    """System and state after some steps of penalties from v, with q before the last."""
    system = System(scene)
    world, state = system.world_under(Penalty()), system.make_state()
    state.v[:] = v
    for _ in range(steps):
        q = state.q.copy()
        assert advance(world, state, np.zeros(len(v))) == OK
    return system, state, q


def tangential(system: Any, state: Any, q: np.ndarray, i: int) -> np.ndarray:
    """J of contact i without its normal part, (3, d)."""
    m, c = system.mechanism, state.contacts
    J = m.point_jacobian(q, int(c.body_a[i]), c.point[i])
    if c.body_b[i] >= 0:
        J = J - m.point_jacobian(q, int(c.body_b[i]), c.point[i])
    return J - np.outer(c.normal[i], c.normal[i] @ J)


@pytest.mark.parametrize("seed", range(6))
def test_each_contact_stops_or_slides_at_its_limit_against_the_friction(seed: int) -> None:
    v = np.random.default_rng(seed).normal(scale=(0.0, 0.02, 1.0)[seed % 3], size=24)
    system, state, q = stepped(pile((2.0, 0.5, 1.0, 0.7)), 12, v)
    c, stuck, slides = state.contacts, 0, 0
    assert state.contact_count[0] >= 5
    for i in range(state.contact_count[0]):
        limit = MU * max(c.normal_force[i], 0.0)
        slip, force = tangential(system, state, q, i) @ state.v, c.friction_force[i]
        assert np.linalg.norm(force) <= limit * (1.0 + 1e-12)
        if np.linalg.norm(force) < 0.999 * limit:
            stuck += 1
            assert np.linalg.norm(slip) <= UNSETTLED
        elif np.linalg.norm(slip) > 1e-4:
            slides += 1
            assert force == pytest.approx(-limit * slip / np.linalg.norm(slip), abs=2e-2 * limit)
    assert slides if seed % 3 == 2 else stuck


@pytest.mark.parametrize("masses", [(1.0, 1.0, 1.0, 1.0), (1e-3, 1e3, 1.0, 1e2), (1e3, 1e-3, 1e-3, 1.0)])
def test_friction_takes_energy_where_the_sweeps_have_not_settled_too(masses: tuple[float, ...]) -> None:
    v, rubbed = np.random.default_rng(3).normal(scale=0.1, size=24), 0
    for steps in range(1, 6):
        system, state, q = stepped(pile(masses), steps, v)
        M = system.mechanism.mass_matrix(q)
        free = state.v - np.linalg.solve(M, state.friction_force) / RATE
        rubbed += bool(np.any(state.friction_force))
        assert state.v @ M @ state.v <= (free @ M @ free) * (1.0 + 1e-12)
        assert state.friction_force @ state.v <= 1e-12 * np.abs(state.friction_force) @ np.abs(state.v)
    assert rubbed


def test_the_factor_makes_the_work_of_any_impulses_negative() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        A, u = rng.normal(size=(3, 5)), rng.normal(size=5)
        p = rng.normal(size=3)
        alpha = passive_factor(p, A @ u, p @ A)
        assert 0.0 <= alpha <= 1.0
        assert alpha * p @ (A @ u) + alpha**2 * (p @ A) @ (p @ A) <= 1e-12
        assert alpha == 1.0 or alpha == 0.0 or 1.001 * alpha * (p @ A) @ (p @ A) > -p @ (A @ u)


BOX = """
name: box_on_a_slope
rate: 1000
duration: 2
gravity: [{along!r}, {down!r}]
bodies:
  - {{name: box, joint: planar, mass: 1.0, inertia: 2.0e-3, position: [0, 0.0245, 0], velocity: [{v}, 0, 0],
     shapes: [{{kind: box, size: [0.15, 0.05]}}]}}
walls:
  - {{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}}
contact: {{forces: paper, stiffness: 1e4, friction: 0.5, coherence_distance: 2e-3}}
"""


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize(("slope", "v"), [(20.0, 0.0), (0.0, 0.2), (20.0, -0.3)])
def test_a_box_stops_and_sticks_under_every_integrator(integrator: str, slope: float, v: float) -> None:
    along, down = 9.81 * math.sin(math.radians(slope)), -9.81 * math.cos(math.radians(slope))
    run = simulate(scene_from_text(BOX.format(along=along, down=down, v=v)), ImpulseAugmented(integrator=integrator))
    slows = -0.5 * down + along * (v < 0.0)  # up the slope its own weight helps
    way = math.copysign(0.5 * v**2 / slows, v)
    late = run.q[1000:, 0]
    assert np.ptp(late) < 1e-9 and np.abs(run.v[1000:]).max() < 1e-9
    assert late[-1] == pytest.approx(way, abs=1.5 * abs(v) / RATE + 5e-5)
    work = np.diff(run.energy["friction_work"], prepend=0.0)
    assert work.max() <= 1e-15


def test_the_explicit_law_costs_nothing_of_it() -> None:
    state = System(pile((1.0, 1.0, 1.0, 1.0), "regularised")).make_state()
    assert state.step_friction.rows.size == 0 and state.step_friction.p.size == 0


def test_the_law_of_a_scene_is_coulombs_unless_it_says_otherwise() -> None:
    assert Scene.model_fields["contact"].get_default(call_default_factory=True).friction_law == "coulomb"
    worlds = [System(pile((1.0,), law)).world_under(Penalty()) for law in ("coulomb", "regularised")]
    assert [world.coulomb for world in worlds] == [True, False]
    frictionless = pile((1.0,)).with_values({"contact.friction": 0})
    assert not System(frictionless).world_under(Penalty()).coulomb


def test_what_earlier_steps_left_in_the_scratch_does_not_count() -> None:
    """The start from the impulses before was judged with slips of contacts that are gone."""
    found = []
    for left in (0.0, 1e6):
        system, state, _ = stepped(pile((2.0, 1.0, 0.5)), 20, np.zeros(18))
        state.step_friction.p[:] = state.step_friction.slip[:] = left
        assert advance(system.world_under(Penalty()), state, np.zeros(18)) == OK
        assert state.contact_count[0] > 0
        found.append(state.v.copy())
    assert np.array_equal(*found)
