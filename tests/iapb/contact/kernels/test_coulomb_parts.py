"""The parts of a step's friction on contacts placed by hand, against dense numpy: rows, sweeps, what is applied."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from iapb.contact.kernels.coulomb import (
    STILL,
    SWEEPS,
    StepFriction,
    _before,
    _fetch,
    _gather,
    _give_back,
    _start,
    _sweep,
    add_step_friction,
    make_step_friction,
    passive_factor,
    remember_friction,
)
from iapb.contact.kernels.rows import tangent_of
from iapb.contact.kernels.step import locate
from iapb.contact.laws import Penalty
from iapb.scene import scene_from_text
from iapb.system import System

DT, MU, TREES = 1.0 / 250.0, 0.7, 5
SPACES = pytest.mark.parametrize("size", [1, 2])  # tangents: in the plane, in space


@cache
def crowd(size: int) -> System:
    """An arm of two links, two free bodies, a piston along y and one more free body: five trees."""
    if size == 1:
        wall, box, inertia, free = "kind: half_plane, point: [0, 0], normal: [0, 1]", "[0.2, 0.2]", "0.03", "planar"
        origin, hinge, lift = "[0.3, 0]", "joint: revolute", "joint: prismatic, axis: [0, 1]"
    else:
        wall, box = "kind: half_space, point: [0, 0, 0], normal: [0, 1, 0]", "[0.2, 0.2, 0.2]"
        inertia, free, origin = "[0.03, 0.05, 0.04]", "free_flyer", "[0.3, 0, 0]"
        hinge, lift = "joint: revolute, axis: [0, 0.6, 0.8]", "joint: prismatic, axis: [0, 1, 0]"
    body = f"shapes: [{{kind: box, size: {box}}}], inertia: {inertia}"
    return System(scene_from_text(f"""
name: crowd
{"" if size == 1 else "dimensions: 3"}
rate: {1.0 / DT}
duration: 1
bodies:
  - {{name: upper, {hinge}, mass: 0.8, {body}}}
  - {{name: fore, parent: upper, origin: {origin}, {hinge}, mass: 0.4, {body}}}
  - {{name: one, joint: {free}, mass: 5, {body}}}
  - {{name: two, joint: {free}, mass: 0.3, {body}}}
  - {{name: piston, {lift}, mass: 1.3, {body}}}
  - {{name: last, joint: {free}, mass: 0.9, {body}}}
walls:
  - {{name: floor, {wall}}}
contact: {{forces: paper, stiffness: 100, friction: {MU}}}
"""))


PAIRS = [(0, -1), (2, 1), (1, 0), (3, 2), (4, -1), (2, 4), (5, 3), (2, -1), (-1, 3), (3, -1)]


class Rubbing:
    """A state with contacts at random places; the rows, limits and slips of those that push, in numpy."""

    def __init__(self, size: int, seed: int, pairs: list[tuple[int, int]] = PAIRS, speed: float = 1.0) -> None:
        rng, system = np.random.default_rng(seed), crowd(size)
        m = system.mechanism
        world, state = system.world_under(Penalty()), system.make_state()
        assert world.coulomb and len(world.tree_start) == TREES
        state.q[:] = m.integrate(m.neutral(), rng.normal(size=m.nv), 1.0)
        state.v[:] = speed * rng.normal(size=m.nv)
        assert locate(world, state)
        c, count = state.contacts, len(pairs)
        c.body_a[:count], c.body_b[:count] = np.transpose(pairs)
        normal = rng.normal(size=(count, 3)) * ([1, 1, 0] if size == 1 else 1)
        normal[c.body_a[:count] == 4] = 0.0, 1.0, 0.0  # along the piston: no tangent moves it
        c.normal[:count] = normal / np.linalg.norm(normal, axis=1)[:, None]
        c.point[:count] = rng.normal(size=(count, 3)) * ([1, 1, 0] if size == 1 else 1)
        c.normal_force[:count] = speed * rng.exponential(100.0, count)
        for name in ("shape_a", "shape_b", "feature"):
            for contacts in (c, state.previous):
                getattr(contacts, name)[:] = rng.integers(0, 2, len(c.feature))  # so that some share all three
        state.previous.friction_force[:] = speed * rng.normal(scale=50.0, size=state.previous.friction_force.shape)
        state.contact_count[:] = count, count - 2
        for name in StepFriction._fields[2:]:
            getattr(state.step_friction, name)[:] = 7.0  # whatever a step before left there
        state.row[:] = 7.0
        self.size, self.m, self.world, self.state, self.v = size, m, world, state, state.v.copy()
        self.M = m.mass_matrix(state.q)
        self.lower = np.linalg.cholesky(self.M)

    def jacobian(self, i: int) -> np.ndarray:
        """J_a − J_b of contact i, (3, d)."""
        c, still = self.state.contacts, np.zeros((3, self.m.nv))
        a, b = (self.m.point_jacobian(self.state.q, int(body), c.point[i]) if body >= 0 else still
                for body in (c.body_a[i], c.body_b[i]))
        return a - b

    def tangents(self, i: int) -> np.ndarray:
        """Unit tangents of contact i, (size, 3)."""
        n = self.state.contacts.normal[i]
        t = np.array([tangent_of(tuple(n), a, self.size) for a in range(self.size)])
        assert t @ t.T == pytest.approx(np.eye(self.size)) and t @ n == pytest.approx(np.zeros(self.size))
        return t

    def pushing(self) -> list[int]:
        """Contacts that push in this step."""
        return [i for i in range(self.state.contact_count[0]) if self.state.contacts.normal_force[i] > 0.0]

    def rows(self) -> np.ndarray:
        """Tangents' rows of J, one block for each contact that pushes."""
        return np.concatenate([self.tangents(i) @ self.jacobian(i) for i in self.pushing()])

    def free_rows(self) -> np.ndarray:
        """Rows B of J L⁻ᵀ: B Bᵀ = J M⁻¹ Jᵀ."""
        return np.linalg.solve(self.lower, self.rows().T).T

    def gathered(self) -> int:
        """Let the kernel gather; the number of contacts that rub."""
        count = int(_gather(self.world, self.state))
        assert count == len(self.pushing())
        return count

    def tree_rows(self, count: int) -> np.ndarray:
        """The kernel's rows, each side where its tree stands: (count·size, d)."""
        f, out = self.state.step_friction, np.zeros((count * self.size, self.m.nv))
        width = f.rows.shape[1] // 2
        for r in range(count):
            for side in range(2):
                mine, tree = f.rows[r * self.size : (r + 1) * self.size, side * width : (side + 1) * width], f.tree[r]
                start, stop = self.m.tree_dofs[tree[side]] if tree[side] >= 0 else (0, 0)
                out[r * self.size : (r + 1) * self.size, start:stop] += mine[:, : stop - start]
                assert not mine[:, stop - start :].any()
        return out


def held_before(scene: Rubbing) -> list[int]:
    """For each contact the one of the step before with the same shapes and feature, the search going round; −1."""
    now, before, total = scene.state.contacts, scene.state.previous, int(scene.state.contact_count[1])
    names, begin, found = ("shape_a", "shape_b", "feature"), 0, []
    for i in scene.pushing():
        same = [j for k in range(total) if all(
            getattr(now, name)[i] == getattr(before, name)[j := (begin + k) % total] for name in names)]
        found.append(same[0] if same else -1)
        begin = found[-1] + 1 if same else begin
    return found


@SPACES
def test_what_is_gathered_are_rows_slips_limits_and_the_impulses_of_the_step_before(size: int) -> None:
    clipped = held = 0
    for seed in range(12):
        scene = Rubbing(size, seed)
        c, f = scene.state.contacts, scene.state.step_friction
        c.normal_force[[seed % 10, (seed + 4) % 10]] = 0.0, -3.0
        count, who = scene.gathered(), scene.pushing()
        assert count == 8 and f.contact[:count].tolist() == who
        for r, i in enumerate(who):
            a, b = (-1 if body < 0 else int(scene.m.tree_of_body[body]) for body in (c.body_a[i], c.body_b[i]))
            assert f.tree[r].tolist() == [a, -1 if a == b else b]
        assert scene.tree_rows(count) == pytest.approx(scene.free_rows(), abs=1e-11)
        assert f.slip[: count * size] == pytest.approx(scene.rows() @ scene.v, abs=1e-11)
        assert f.radius[:count] == pytest.approx(MU * c.normal_force[who] * DT, rel=1e-15)
        B = scene.free_rows().reshape(count, size, -1)
        assert f.inertia[:count] == pytest.approx([np.linalg.eigvalsh(b @ b.T)[-1] for b in B], rel=1e-9, abs=1e-12)
        for r, before in enumerate(held_before(scene)):
            p = DT * scene.tangents(who[r]) @ scene.state.previous.friction_force[before] * (before >= 0)
            held += before >= 0
            length = float(np.linalg.norm(p))
            if length > f.radius[r]:
                clipped += 1
                p *= f.radius[r] / length
            assert f.p[r * size : (r + 1) * size] == pytest.approx(p, abs=1e-14)
    assert 0 < clipped < held


def test_a_contact_of_the_step_before_is_that_with_the_same_shapes_and_feature() -> None:
    scene = Rubbing(1, 0)
    now, before, total = scene.state.contacts, scene.state.previous, 4
    scene.state.contact_count[1] = total
    now.shape_a[0], now.shape_b[0], now.feature[0] = 3, 4, 5
    for other in ((2, 4, 5), (3, 2, 5), (3, 4, 2)):
        before.shape_a[:], before.shape_b[:], before.feature[:] = other
        assert _before(scene.state, 0, 1) == -1
        for j in range(total):
            before.shape_a[j], before.shape_b[j], before.feature[j] = 3, 4, 5
            assert [_before(scene.state, 0, begin) for begin in range(total + 1)] == [j] * (total + 1)
            before.shape_a[j], before.shape_b[j], before.feature[j] = other
    before.shape_a[:], before.shape_b[:], before.feature[:] = 3, 4, 5  # all alike: the search begins where it is told
    assert [_before(scene.state, 0, begin) for begin in range(total + 1)] == [0, 1, 2, 3, 0]


@SPACES
def test_the_first_impulses_are_kept_where_they_take_energy(size: int) -> None:
    """p · slip + ½ |Bᵀp|² is not above zero up to p = −s slip with s = 2 slip² / |Bᵀ slip|²."""
    for seed in range(4):
        scene = Rubbing(size, seed)
        f, count, B = scene.state.step_friction, scene.gathered(), scene.free_rows()
        slip = f.slip[: count * size].copy()
        critical = 2.0 * slip @ slip / np.sum((slip @ B) ** 2)
        for share, kept in ((0.0, 1), (0.5, 1), (0.999999, 1), (1.000001, 0), (3.0, 0), (-0.001, 0)):
            p = -share * critical * slip
            f.p[: count * size], f.moved[:] = p, 5.0
            _start(scene.world, scene.state, count)
            assert f.p[: count * size] == pytest.approx(kept * p, abs=0.0)
            assert f.moved == pytest.approx(kept * p @ B, abs=1e-12 * np.abs(p).max(initial=1.0))


@SPACES
def test_a_contact_reads_and_writes_what_its_two_trees_move_by(size: int) -> None:
    scene = Rubbing(size, 1)
    f, count = scene.state.step_friction, scene.gathered()
    width, mark = f.local.shape[0] // 2, np.arange(1.0, 1.0 + scene.m.nv)
    for r in range(count):
        f.moved[:], f.local[:], expected, after = mark, 7.0, np.zeros(2 * width), mark.copy()
        for side, tree in enumerate(f.tree[r]):
            if tree >= 0:
                start, stop = scene.m.tree_dofs[tree]
                expected[side * width : side * width + stop - start] = mark[start:stop]
                after[start:stop] += 100.0
        _fetch(scene.world, f, r)
        assert np.array_equal(f.local, expected)
        f.local[:] += 100.0
        _give_back(scene.world, f, r)
        assert np.array_equal(f.moved, after)


def swept(B: np.ndarray, slip: np.ndarray, radius: np.ndarray, p: np.ndarray, size: int) -> tuple[np.ndarray, int]:
    """Impulses after the sweeps of the stop rule, and how many there were: each contact stops or makes one step."""
    p, still = p.copy(), STILL * np.abs(slip).max()
    for sweep in range(1, SWEEPS + 1):
        fastest = 0.0
        for r in range(len(radius)):
            of = slice(r * size, (r + 1) * size)
            own = B[of] @ B[of].T
            rho = np.linalg.eigvalsh(own)[-1]
            if rho < 1e-12:
                continue
            w = slip[of] + B[of] @ (B.T @ p)
            new, made = p[of] - w / rho, math.nan
            stopped = p[of] - np.linalg.lstsq(own, w, rcond=1e-12)[0]
            if size == 2 and np.linalg.det(own) > 1e-12 * own[0, 0] * own[1, 1] and (
                    np.linalg.norm(stopped) <= radius[r]):
                new, made = stopped, float(np.linalg.norm(w))
            else:
                new *= min(1.0, radius[r] / np.linalg.norm(new))
                made = float(rho * np.abs(new - p[of]).max())
            p[of], fastest = new, max(fastest, made)
        if fastest <= still:
            return p, sweep
    return p, SWEEPS


@SPACES
@pytest.mark.parametrize("speed", [1e-3, 1.0, 1e3])
def test_sweeps_go_on_until_one_moves_nothing(size: int, speed: float) -> None:
    took = set()
    for seed in range(5):
        scene = Rubbing(size, seed, PAIRS if seed < 4 else PAIRS[:3], speed)
        f, count = scene.state.step_friction, scene.gathered()
        _start(scene.world, scene.state, count)
        n, B = count * size, scene.free_rows()
        first = f.p[:n].copy()
        expected, sweeps = swept(B, f.slip[:n].copy(), f.radius[:count], first, size)
        _sweep(scene.world, scene.state, count)
        assert f.p[:n] == pytest.approx(expected, abs=1e-11 * speed)
        assert f.moved == pytest.approx(expected @ B, abs=1e-10 * speed)
        still = [r for r in range(count) if f.contact[r] == 4]  # the piston's tangents move nothing
        for r in still:
            assert f.inertia[r] == 0.0 and np.array_equal(f.p[r * size : (r + 1) * size],
                                                          first[r * size : (r + 1) * size])
        took.add(sweeps)
    assert len(took) > 1 and min(took) < SWEEPS


@SPACES
def test_contacts_that_no_tangent_moves_are_passed_over(size: int) -> None:
    scene = Rubbing(size, 2, [(4, -1)])
    before = scene.v.copy()
    assert scene.gathered() == 1 and scene.state.step_friction.inertia[0] == 0.0
    add_step_friction(scene.world, scene.state)
    assert np.array_equal(scene.state.v, before)


@SPACES
def test_the_step_is_given_the_impulses_as_forces_at_the_contacts(size: int) -> None:
    """F_i = Σ α p_a t_a / Δt, generalized Σ Jᵀ F_i, Δv = Δt M⁻¹ of it; trees that rub move with the new velocity."""
    for seed in range(8):
        scene = Rubbing(size, seed, [PAIRS, PAIRS[:6], PAIRS[7:], PAIRS[1:2], [(5, -1)]][seed % 5])
        state, f = scene.state, scene.state.step_friction
        if seed % 5 == 0:
            state.contacts.normal_force[3] = -1.0
        state.friction_force[:], state.mean_v[:] = 0.0, 11.0
        state.contacts.friction_force[:] = 13.0
        add_step_friction(scene.world, state)
        who, total = scene.pushing(), np.zeros(scene.m.nv)
        n = len(who) * size
        alpha = passive_factor(f.p[:n], scene.rows() @ scene.v, f.p[:n] @ scene.free_rows())
        for r, i in enumerate(who):
            force = alpha * f.p[r * size : (r + 1) * size] @ scene.tangents(i) / DT
            assert state.contacts.friction_force[i] == pytest.approx(force, rel=1e-9, abs=1e-9)
            assert np.linalg.norm(force) <= MU * state.contacts.normal_force[i] * (1.0 + 1e-12)
            total += scene.jacobian(i).T @ force
        others = np.setdiff1d(np.arange(len(state.contacts.feature)), who)
        assert np.all(state.contacts.friction_force[others] == 13.0)
        assert np.any(total) and state.friction_force == pytest.approx(total, abs=1e-9)
        assert state.v == pytest.approx(scene.v + DT * np.linalg.solve(scene.M, total), abs=1e-10)
        rubbing = {int(scene.m.tree_of_body[b]) for i in who
                   for b in (state.contacts.body_a[i], state.contacts.body_b[i]) if b >= 0}  # fmt: skip
        for tree, (start, stop) in enumerate(scene.m.tree_dofs):
            assert np.all(state.mean_v[start:stop] == (state.v[start:stop] if tree in rubbing else 11.0))
        assert state.v @ scene.M @ state.v <= scene.v @ scene.M @ scene.v * (1.0 + 1e-12)


@SPACES
def test_without_a_contact_that_pushes_nothing_changes(size: int) -> None:
    scene = Rubbing(size, 3)
    scene.state.contacts.normal_force[:] = np.tile([0.0, -2.0], 99)[: len(scene.state.contacts.feature)]
    scene.state.friction_force[:], scene.state.mean_v[:] = 0.0, 11.0
    add_step_friction(scene.world, scene.state)
    assert np.array_equal(scene.state.v, scene.v)
    assert np.all(scene.state.mean_v == 11.0) and not scene.state.friction_force.any()


def test_the_forces_of_a_step_are_remembered_for_the_next() -> None:
    scene = Rubbing(2, 0)
    now, before = scene.state.contacts.friction_force, scene.state.previous.friction_force
    now[:] = np.random.default_rng(0).normal(size=now.shape)
    beyond = before[10:].copy()
    remember_friction(scene.state)
    assert np.array_equal(before[:10], now[:10]) and np.array_equal(before[10:], beyond)


def test_the_passive_factor_of_an_impulse_and_what_it_moves() -> None:
    """The largest α ≤ 1 with α p·slip + α² |moved|² ≤ 0; slips beyond the impulses are no one's."""
    p, junk = np.array([1.0, -2.0]), 1e6
    for slip, moved, alpha in (([-4.0, 0.0], 2.0, 1.0), ([-4.0, 0.0], 4.0, 0.25), ([-1.0, 0.0], 0.1, 1.0),
                               ([0.0, 0.0], 1.0, 0.0), ([0.25, 0.0], 0.1, 0.0), ([-0.5, 0.0], 1.0, 0.5)):
        assert passive_factor(p, np.array([*slip, junk]), np.array([0.0, moved])) == pytest.approx(alpha)


def test_the_scratch_has_a_place_for_every_contact_tangent_and_coordinate() -> None:
    f = make_step_friction(7, 5, 2, 3)
    shapes = {name: array.shape for name, array in f._asdict().items()}
    assert shapes == {"contact": (5,), "tree": (5, 2), "rows": (10, 6), "slip": (10,), "p": (10,), "radius": (5,),
                      "inertia": (5,), "moved": (7,), "local": (6,), "velocity": (2,)}
    assert not any(array.any() for array in f)
