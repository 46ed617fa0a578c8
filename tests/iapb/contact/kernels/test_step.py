"""One compiled step of a crowd in space against the paper's page, (1) to (21), in plain numpy."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pytest

import iapb.contact.kernels.broadphase
import iapb.system
from iapb.compiled import block
from iapb.contact.kernels.step import OK, advance, contact_state, locate, touching
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.run import COLLIDING, FREE, RESTING
from iapb.scene import Scene, find_scene, load_scene, scene_from_text
from iapb.system import System

K, B, MU, THRESHOLD, E, SLOW = 300.0, 2.0, 0.3, 0.05, 0.4, 1e-3
BALL, BOX = "{kind: sphere, radius: 0.1, center: [0.02, 0, 0.01]}", "{kind: box, size: [0.3, 0.2, 0.25]}"


def body(k: int) -> str:
    return (f"  - {{name: b{k}, joint: free_flyer, mass: {0.5 + 0.3 * k}, inertia: [{1 + k}e-3, 2e-3, 3e-3], "
            f"shapes: [{BOX if k == 2 else BALL}]}}\n")


def crowd(rows: str) -> System:
    return System(scene_from_text(f"""
name: crowd
dimensions: 3
integrator: semi_implicit_euler
rate: 1000
duration: 0.1
gravity: [0.3, -0.2, -9.81]
bodies:
{''.join(body(k) for k in range(6))}
walls:
  - {{name: floor, kind: half_space, point: [0, 0, -0.3], normal: [0.1, 0, 1]}}
contact: {{forces: paper, stiffness: {K}, damping: {B}, friction: {MU}, friction_law: regularised,
          friction_velocity: {THRESHOLD}, restitution: {E},
          approach_velocity: {SLOW}, self_collision_rows: {rows}}}
"""))


def thrown(system: System, seed: int, old: bool) -> tuple[Any, Any]:
    """World and state with bodies thrown together; `old`: some contacts were there in the step before."""
    rng, m = np.random.default_rng(seed), system.mechanism
    world, state = system.world_under(ImpulseAugmented()), system.make_state()
    state.q[:] = m.integrate(m.neutral(), rng.normal(size=m.nv) * np.tile([0.16] * 3 + [1.0] * 3, 6), 1.0)
    state.v[:] = rng.normal(size=m.nv)
    if old:
        q, v = state.q.copy(), state.v.copy()
        assert advance(world, state, np.zeros(m.nv)) == OK
        state.q[:], state.v[:] = q, v
        state.contacts.feature[: state.contact_count[0] : 2] += 1000  # so that every second one is new
    return world, state


class Page:
    """What the step should do, from (q, v) before it and the touching places that it found."""

    def __init__(self, system: System, state: Any, q: np.ndarray, v: np.ndarray) -> None:
        self.m, self.q, self.v, self.c = system.mechanism, q, v, state.contacts
        self.count = int(state.contact_count[0])
        self.M = self.m.mass_matrix(q)
        self.jacobians = [self._relative(i) for i in range(self.count)]

    def _relative(self, i: int) -> np.ndarray:
        x, b = self.c.point[i], int(self.c.body_b[i])
        J = self.m.point_jacobian(self.q, int(self.c.body_a[i]), x)
        return J - self.m.point_jacobian(self.q, b, x) if b >= 0 else J

    def groups(self) -> list[int]:
        """Smallest body that touching connects each body to."""
        group = list(range(6))
        for _ in range(6):
            for a, b in zip(self.c.body_a[: self.count], self.c.body_b[: self.count], strict=True):
                if b >= 0:
                    group[a] = group[b] = min(group[a], group[b])
        return group

    def collide(self, is_new: np.ndarray) -> tuple[list[int], np.ndarray]:
        """State of each body, and which contacts enter the impact."""
        group = self.groups()
        of = [group[a] for a in self.c.body_a[: self.count]]
        speed = np.array([self.c.normal[i] @ J @ self.v for i, J in enumerate(self.jacobians)])
        struck = {of[i] for i in range(self.count) if is_new[i] and speed[i] < -SLOW}
        states = [COLLIDING if group[k] in struck else RESTING if group[k] in of else FREE for k in range(6)]
        return states, np.array([of[i] in struck and speed[i] < -SLOW for i in range(self.count)], bool)

    def impact(self, collides: np.ndarray, per_body: bool) -> tuple[np.ndarray, np.ndarray, list[int], np.ndarray]:
        """(19): J, p of least norm, the contact of each row, v⁺; M is block diagonal, so islands need no telling."""
        rows, owner = [], []
        for i in np.flatnonzero(collides):
            owner += [int(i)] * (2 if per_body and self.c.body_b[i] >= 0 else 1)
            row = self.c.normal[i] @ self.jacobians[i]
            b = int(self.c.body_b[i])
            if per_body and b >= 0:
                of = np.arange(36) // 6
                rows += [np.where(of == self.c.body_a[i], row, 0.0), np.where(of == b, -row, 0.0)]  # nᵀJ of either
            else:
                rows.append(row)
        J = np.array(rows).reshape(-1, 36)
        p = -(1.0 + E) * np.linalg.pinv(J @ np.linalg.solve(self.M, J.T), rcond=1e-12) @ J @ self.v
        return J, p, owner, self.v + np.linalg.solve(self.M, J.T @ p)

    def resting(self, states: list[int], v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(5), (6) of the contacts whose group does not collide, with the velocities before the impact elsewhere."""
        penalty, drag = np.zeros(36), np.zeros(36)
        for i, J in enumerate(self.jacobians):
            if states[int(self.c.body_a[i])] == COLLIDING:
                continue
            n, relative = self.c.normal[i], J @ v
            force = max(0.0, -K * self.c.gap[i] - B * (n @ relative))
            slip = relative - (n @ relative) * n
            penalty += J.T @ n * force
            drag -= J.T @ slip * MU * force / max(float(np.linalg.norm(slip)), THRESHOLD)
        return penalty, drag


def lasting(state: Any) -> list[tuple[int, ...]]:
    c, count = state.contacts, int(state.contact_count[0])
    return [tuple(int(getattr(c, name)[i]) for name in ("shape_a", "shape_b", "feature")) for i in range(count)]


@pytest.mark.parametrize("old", [False, True])
@pytest.mark.parametrize("rows", ["relative", "per_body"])
def test_a_step_is_the_page_of_the_paper(rows: str, old: bool) -> None:
    system, seen = crowd(rows), set()
    for seed in range(8):
        world, state = thrown(system, seed, old)
        q, v, before = state.q.copy(), state.v.copy(), lasting(state)
        applied = np.random.default_rng(seed).normal(size=36)
        assert advance(world, state, applied) == OK
        page = Page(system, state, q, v)
        is_new = np.array([key not in before for key in lasting(state)], bool)
        np.testing.assert_array_equal(state.contacts.is_new[: page.count], is_new)
        states, collides = page.collide(is_new)
        assert state.state_of_tree.tolist() == states
        np.testing.assert_array_equal(state.contacts.collides[: page.count], collides)
        J, p, owner, v_plus = page.impact(collides, rows == "per_body")
        np.testing.assert_allclose(state.impulse, J.T @ p, atol=1e-9)
        first = [owner.index(i) if collides[i] else -1 for i in range(page.count)]  # of two rows that on body a
        expected = [p[row] if row >= 0 else 0.0 for row in first]
        np.testing.assert_allclose(state.contact_impulse[: page.count], expected, atol=1e-9)
        penalty, drag = page.resting(states, v_plus)
        np.testing.assert_allclose(state.penalty_force, penalty, atol=1e-9)
        np.testing.assert_allclose(state.friction_force, drag, atol=1e-9)
        force = applied + penalty + drag - page.m.gravity(q, system.gravity) - page.m.bias(q, v_plus)
        moved = v_plus + system.dt * np.linalg.solve(page.M, force)
        np.testing.assert_allclose(state.v, moved, atol=1e-9)
        np.testing.assert_allclose(state.q, page.m.integrate(q, moved, system.dt), atol=1e-11)
        _check_log(state, page, collides, v_plus, J, p)
        seen |= set(states)
    assert seen == {FREE, COLLIDING, RESTING} or (not old and COLLIDING in seen)


def _check_log(state: Any, page: Page, collides: np.ndarray, v_plus: np.ndarray, J: np.ndarray, p: np.ndarray) -> None:
    """One line for each island: bodies that colliding contacts connect, their impulse and the energy they lost."""
    island = list(range(6))
    for _ in range(6):
        for i in np.flatnonzero(collides):
            a, b = int(page.c.body_a[i]), int(page.c.body_b[i])
            if b >= 0:
                island[a] = island[b] = min(island[a], island[b])
    first = sorted({island[int(page.c.body_a[i])] for i in np.flatnonzero(collides)})
    log, lines = state.impacts, int(state.impacts.logged[0])
    assert log.group[:lines].tolist() == first
    for line, root in enumerate(first):
        mine = np.repeat(np.array(island) == root, 6)
        change = np.where(mine, v_plus - page.v, 0.0)
        np.testing.assert_allclose(log.v_minus[line][mine], page.v[mine], atol=0.0)
        np.testing.assert_allclose(log.v_plus[line][mine], v_plus[mine], atol=1e-9)
        np.testing.assert_allclose(log.impulse[line], np.where(mine, J.T @ p, 0.0), atol=1e-9)
        lost = -(page.v + 0.5 * change) @ page.M @ change
        assert log.energy_lost[line] == pytest.approx(lost, abs=1e-9)
        of_island = J[np.any(J[:, mine] != 0.0, axis=1)]
        assert (log.rows[line], log.rank[line]) == (len(of_island), np.linalg.matrix_rank(of_island, tol=1e-9))
        assert log.approaching[line] == np.count_nonzero(of_island @ v_plus < -SLOW)
        assert log.solved[line] and log.scale[line] == log.friction_share[line] == 1.0
        assert log.clamp[line] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("varies", [False, True])
def test_the_mass_matrix_and_its_factor_are_those_of_the_place_where_they_depend_on_it(varies: bool) -> None:
    system = System(load_scene(find_scene("two_link_arm_b"))) if varies else crowd("relative")
    world, state, m = system.world_under(Penalty()), system.make_state(), system.mechanism
    assert world.switches.varying_inertia == varies
    for seed in range(3):
        state.q[:] = m.integrate(m.neutral(), np.random.default_rng(seed).normal(size=m.nv), 1.0)
        assert locate(world, state)
        np.testing.assert_allclose(state.body.position, m.placements(state.q)[1], atol=1e-13)
        np.testing.assert_allclose(state.mass_matrix, m.mass_matrix(state.q), atol=1e-13)
        np.testing.assert_allclose(state.lower, np.linalg.cholesky(state.mass_matrix), atol=1e-13)


def test_without_impulses_what_would_collide_rests() -> None:
    system = crowd("relative")
    _, state = thrown(system, 3, False)
    q, v = state.q.copy(), state.v.copy()
    assert advance(system.world_under(Penalty()), state, np.zeros(36)) == OK
    page = Page(system, state, q, v)
    assert page.collide(np.ones(page.count, bool))[1].any()
    assert not state.impulse.any() and state.impacts.logged[0] == 0
    touching = {page.groups()[int(a)] for a in page.c.body_a[: page.count]}
    assert state.state_of_tree.tolist() == [RESTING if g in touching else FREE for g in page.groups()]
    np.testing.assert_allclose(state.penalty_force, page.resting([RESTING] * 6, v)[0], atol=1e-9)


def test_the_forces_noted_at_the_contacts_carry_the_box() -> None:
    """With one stage per step the forces at the contacts are those that the step applied."""
    system = System(load_scene(find_scene("sliding_box")))
    world, state = system.world_under(Penalty()), system.make_state()
    applied = np.zeros(system.mechanism.nv)
    for _ in range(3):
        assert advance(world, state, applied) == OK
    count, contacts = state.contact_count[0], state.contacts
    normal = contacts.normal[:count] * contacts.normal_force[:count, None]
    assert count > 0 and np.any(normal != 0.0)
    assert state.penalty_force[:2] == pytest.approx(normal.sum(axis=0)[:2], abs=1e-12)
    friction = contacts.friction_force[:count].sum(axis=0)
    assert np.any(friction != 0.0)
    assert state.friction_force[:2] == pytest.approx(friction[:2], abs=1e-12)


def discs() -> Scene:
    bodies = "".join(
        f"  - {{name: disc_{k}, joint: planar, mass: 0.1, inertia: 1e-5, shapes: [{{kind: circle, radius: 0.5}}]}}\n"
        for k in range(12)
    )
    return scene_from_text("name: discs\nrate: 1000\nduration: 0.1\ncontact: {forces: paper, stiffness: 500}\n"
                           f"bodies:\n{bodies}")


def test_more_near_pairs_than_there_is_room_for_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(iapb.system, "_PARTS", {})  # what is made here is for nobody else
    monkeypatch.setattr(iapb.system, "WORTHWHILE_PAIRS", 0)
    monkeypatch.setattr(iapb.contact.kernels.broadphase, "PAIRS_PER_SHAPE", 0)  # room for one pair
    system = System(discs())
    world, state = system.world_under(Penalty()), system.make_state()  # all discs at one place
    assert locate(world, state)
    assert touching(world, state, state.contacts) < 0


def test_a_contact_that_was_gone_for_a_step_is_new() -> None:
    system = crowd("relative")
    world, state = thrown(system, 0, old=False)
    m, q, v, still = system.mechanism, state.q.copy(), state.v.copy(), np.zeros(36)
    apart = m.integrate(m.neutral(), np.array([[10.0 * k, 0.0, 20.0, 0.0, 0.0, 0.0] for k in range(6)]).ravel(), 1.0)
    news = []
    for place in (q, q, apart, q):
        state.q[:], state.v[:] = place, v
        assert advance(world, state, still) == OK
        news.append(state.contacts.is_new[: state.contact_count[0]].tolist())
    first, lasted, gone, again = news
    assert len(first) > 2 and all(first) and not any(lasted) and gone == [] and again == first


def test_a_step_of_a_linkage_by_runge_kutta_is_the_textbooks() -> None:
    """The classical method on (q, v), in numpy, with mass matrix and bias at each stage's own place."""
    system = System(load_scene(find_scene("double_pendulum")))
    world, state, m = system.world_under(Penalty(integrator="runge_kutta_4")), system.make_state(), system.mechanism
    rng, h = np.random.default_rng(0), system.dt
    q, v, applied = rng.normal(size=m.nv), 10.0 * rng.normal(size=m.nv), rng.normal(size=m.nv)
    state.q[:], state.v[:] = q, v

    def rate(y: np.ndarray) -> np.ndarray:
        force = applied - m.gravity(y[: m.nq], system.gravity) - m.bias(y[: m.nq], y[m.nq :])
        return np.concatenate([y[m.nq :], np.linalg.solve(m.mass_matrix(y[: m.nq]), force)])

    y = np.concatenate([q, v])
    a = rate(y)
    b = rate(y + h / 2 * a)
    c = rate(y + h / 2 * b)
    d = rate(y + h * c)
    assert advance(world, state, applied) == OK
    np.testing.assert_allclose(np.concatenate([state.q, state.v]), y + h / 6 * (a + 2 * b + 2 * c + d), atol=1e-12)


def test_the_broad_phase_leaves_out_no_touching_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve discs thrown together: the contacts of the near pairs are those of all pairs."""
    scene = discs()
    q = np.random.default_rng(1).uniform(-1.5, 1.5, 36)
    touched = []
    for worthwhile in (0, 10**9):
        monkeypatch.setattr(iapb.system, "WORTHWHILE_PAIRS", worthwhile)
        system = System(scene)
        world, state = system.world_under(Penalty()), system.make_state()
        assert world.switches.broad_phase == (worthwhile == 0)
        state.q[:] = q
        assert locate(world, state)
        count = touching(world, state, state.contacts)
        touched.append(list(zip(state.contacts.shape_a[:count], state.contacts.shape_b[:count], strict=True)))
    assert touched[0] == touched[1] and len(touched[0]) > 5


class Trees(NamedTuple):
    """What `contact_state` reads of a state."""

    state_of_tree: np.ndarray


@pytest.mark.parametrize("states", list(product([FREE, RESTING, COLLIDING], repeat=3)))
def test_the_state_is_the_tools_or_the_hardest_of_all(states: tuple[int, ...]) -> None:
    trees: Any = block(Trees(np.array(states, np.int8)))
    for tool in range(3):
        assert contact_state(trees, tool) == states[tool]
    hardest = next(state for state in (COLLIDING, RESTING, FREE) if state in states)
    assert contact_state(trees, -1) == hardest
