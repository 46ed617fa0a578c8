"""A collision under the device's limits: one factor for the whole group of the tool, in numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.contact.kernels.collide import gather_restitution, largest_share, pair_restitution
from iapb.contact.kernels.step import OK, advance
from iapb.contact.laws import ImpulseAugmented
from iapb.scene import scene_from_text
from iapb.system import System

E, SLOW = 0.4, 1e-3
DISC = "joint: planar, mass: 1, inertia: 0.01, shapes: [{kind: circle, radius: 0.2}]"
LIMIT = np.array([40.0, 30.0, 0.5])


def system_of() -> System:
    """Five discs, the tool is the third; it carries its disc off its origin, so that blows turn it."""
    tool = DISC.replace("0.2}", "0.2, center: [0.1, 0.05]}")
    bodies = "".join(f"  - {{name: b{k}, {tool if k == 2 else DISC}}}\n" for k in range(5))
    return System(scene_from_text(f"""
name: struck
rate: 100
duration: 0.1
bodies:
{bodies}
contact: {{stiffness: 0, damping: 0, restitution: {E}, approach_velocity: {SLOW}}}
hand: {{body: b2, force: [0, 0, 0]}}
device: {{force_limit: {LIMIT.tolist()}}}
"""))


def groups_of(contacts: Any, count: int) -> list[int]:
    group = list(range(5))
    for _ in range(5):
        for a, b in zip(contacts.body_a[:count], contacts.body_b[:count], strict=True):
            group[a] = group[b] = min(group[a], group[b])
    return group


@pytest.mark.parametrize("rendering", ["scale", "spread"])
def test_a_group_gets_the_largest_share_that_the_device_can_give(rendering: str) -> None:
    """Of every group the whole impulse is scaled by min(1, F_limit Δt / |p|) over the tool's coordinates."""
    system, scaled, whole = system_of(), 0, 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        world, state = system.world_under(ImpulseAugmented(rendering=rendering)), system.make_state()
        state.q[:] = rng.normal(size=15) * np.tile([0.3, 0.3, 1.0], 5)
        state.v[:] = rng.normal(size=15) * rng.choice([0.1, 2.0])
        q, v = state.q.copy(), state.v.copy()
        assert advance(world, state, np.zeros(15)) == OK
        c, count = state.contacts, int(state.contact_count[0])
        M, J = system.mechanism.mass_matrix(q), np.zeros((count, 15))
        for i in range(count):
            for body, sign in ((int(c.body_a[i]), 1.0), (int(c.body_b[i]), -1.0)):
                J[i] += sign * c.normal[i] @ system.mechanism.point_jacobian(q, body, c.point[i])
        chosen = np.flatnonzero(J @ v < -SLOW)
        p = np.zeros(count)
        rows = J[chosen]
        p[chosen] = -(1.0 + E) * np.linalg.pinv(rows @ np.linalg.solve(M, rows.T), rcond=1e-12) @ rows @ v
        group, share = np.array(groups_of(c, count)), np.ones(15)
        mine = np.repeat(group == group[2], 3)
        asked = np.abs((J.T @ p)[6:9]) / system.dt
        factor = min([1.0, *(limit / force for limit, force in zip(LIMIT, asked, strict=True) if force > 0.0)])
        share[mine] = factor
        impulse = share * (J.T @ p)
        np.testing.assert_allclose(state.impulse, impulse, atol=1e-10)
        change = np.linalg.solve(M, impulse)
        after = v + change
        force = system.mechanism.bias(q, after)
        np.testing.assert_allclose(state.v, after - system.dt * np.linalg.solve(M, force), atol=1e-9)
        of_contact = np.where(group[c.body_a[:count]] == group[2], factor, 1.0)
        np.testing.assert_allclose(state.contact_impulse[:count], of_contact * p, atol=1e-10)
        spreads = rendering == "spread" and factor < 1.0
        assert state.spreading.tolist() == [bool(spreads and g == group[2]) for g in group]
        for line in range(int(state.impacts.logged[0])):
            root, its = int(state.impacts.group[line]), np.repeat(group == state.impacts.group[line], 3)
            assert state.impacts.scale[line] == pytest.approx(factor if root == group[2] else 1.0, rel=1e-12)
            lost = -(v + 0.5 * change)[its] @ impulse[its]
            assert state.impacts.energy_lost[line] == pytest.approx(lost, abs=1e-10)
            still = np.count_nonzero(rows[:, its].any(axis=1) & (rows @ after < -SLOW))
            assert state.impacts.approaching[line] == still
        scaled, whole = scaled + (factor < 1.0), whole + (factor == 1.0 and len(chosen) > 0)
    assert scaled > 2 and whole > 2


@pytest.mark.parametrize(("restitution", "leaves_with", "steps"), [(0.0, 0.0, 7), (0.5, 0.0025, None)])
def test_spreading_delivers_the_prescribed_velocity_for_plastic_impacts_only(
    restitution: float, leaves_with: float, steps: int | None
) -> None:
    """Erratum 5, with its numbers: 2 kg at 0.1 m/s, 15 N and 512 Hz leave with 0.0025 m/s instead of 0.05 m/s."""
    velocity, share, done = -0.1, 0.0, 0
    while velocity < 0.0 and share < 1.0:
        impulse = -(1.0 + restitution) * 2.0 * velocity
        share = largest_share(np.array([impulse]), np.zeros(1, np.int64), 1, 1.0 / 512.0, np.array([15.0]))
        velocity, done = velocity + share * impulse / 2.0, done + 1
    assert velocity == pytest.approx(leaves_with, abs=5e-5) and steps in (None, done)


def test_of_two_shapes_the_smaller_restitution_counts_and_the_scene_s_where_neither_has_one() -> None:
    none = 2.0
    own = np.array([none, 0.8, 0.3, 1.0])
    for a, b, expected in ((0, 1, 0.8), (1, 0, 0.8), (1, 2, 0.3), (0, 0, 0.5), (0, 3, 1.0), (3, 1, 0.8)):
        assert pair_restitution(own, a, b, 0.5) == expected


@pytest.mark.parametrize("shapes", [(0, 1), (0, 0), (1, 1), (0, 2), (2, 2), (2, 1, 0)])
def test_rows_that_agree_in_restitution_are_no_case_for_poisson(shapes: tuple[int, ...]) -> None:
    """The smallest e of the rows, and whether they differ at all."""
    own = {0: 0.2, 1: 0.7, 2: E}  # the third body gives none: the scene's
    bodies = "".join(f"  - {{name: b{k}, {DISC}, restitution: {own[k]}}}\n" for k in range(2))
    system = System(scene_from_text(
        f"name: unlike\nrate: 100\nduration: 0.1\nbodies:\n{bodies}  - {{name: b2, {DISC}}}\n"
        "walls: [{name: floor, kind: half_plane, point: [0, -9], normal: [0, 1]}]\n"
        f"contact: {{stiffness: 0, restitution: {E}}}\n"
    ))
    world, state = system.world_under(ImpulseAugmented()), system.make_state()
    for row, shape in enumerate(shapes):  # each against the floor
        state.rows[row] = row
        state.contacts.shape_a[row], state.contacts.shape_b[row] = shape, 3
    smallest, differ = gather_restitution(world, state, len(shapes))
    expected = [own[shape] for shape in shapes]
    assert smallest == min(expected) and bool(differ) == (min(expected) < max(expected))
    assert state.row_restitution[: len(shapes)].tolist() == expected
