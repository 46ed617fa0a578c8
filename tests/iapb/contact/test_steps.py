"""Every step of a run with the paper's forces is the paper's: contacts, states, impulses, forces and
motion, judged from the record alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb import resolve_frictional_impact, resolve_impact
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.run import COLLIDING, FREE, RESTING, Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from iapb.system import System
from tests.given import data_of
from tests.iapb.contact import paper
from verification.certificate import certify

Values = dict[str, Any]
ROUNDING = 1e-9  # of sums of a few dozen products, in units of the largest


GIVEN = data_of(__file__, "steps.yaml")
CASES = GIVEN["cases"]


def scene_and_law(case: Values) -> tuple[Scene, Any]:
    if "shipped" in case:
        scene = load_scene(find_scene(case["shipped"]))
    else:
        scene = scene_from_values(GIVEN["scenes"][case["scene"]])
    law = case.get("law", {})
    made = Penalty() if law == "penalty" else ImpulseAugmented(**law)
    return scene.with_values(case.get("set", {})), made


class Step:
    """One step of a run: its contacts, their rows and what the paper says of them."""

    def __init__(
        self,
        system: System,
        law: Any,
        run: Run,
        k: int,
        before: list[paper.Contact],
        spreading: set[int],
    ) -> None:
        self.system = system
        self.law = law
        self.run = run
        self.k = k
        self.m = system.mechanism
        self.scene = system.scene
        self.q = run.q[k]
        self.v = run.v[k]
        self.table = {
            name: getattr(run.contacts, name)[slice(*run.contacts.offsets[k : k + 2])]
            for name in (
                "body_a",
                "body_b",
                "point",
                "normal",
                "gap",
                "normal_velocity",
                "normal_force",
                "friction_force",
                "impulse",
                "is_new",
            )
        }
        self.contacts = paper.contacts_of(system, self.q)
        assert [c.bodies for c in self.contacts] == list(
            zip(self.table["body_a"], self.table["body_b"], strict=True)
        )
        np.testing.assert_allclose(self.table["gap"], [c.gap for c in self.contacts], atol=1e-14)
        for name in ("point", "normal"):
            places = np.reshape([getattr(c, name) for c in self.contacts], (-1, 3))
            np.testing.assert_array_equal(places, self.table[name])
        self.jacobians = [paper.relative_jacobian(self.m, self.q, c) for c in self.contacts]
        self.speeds = np.array(
            [c.normal @ J @ self.v for c, J in zip(self.contacts, self.jacobians, strict=True)]
        )
        self.new = [
            paper.is_new(c, before, self.scene.contact.coherence_distance) for c in self.contacts
        ]
        self.set_states(spreading)

    def of(self, groups: Any, c: paper.Contact) -> int:
        """The group of a contact, that of its first body that moves; −1 if nothing of it moves."""
        tree = next((tree for body in c.bodies if (tree := paper.tree_of(self.m, body)) >= 0), -1)
        return int(groups[tree]) if tree >= 0 else -1

    def set_states(self, spreading: set[int]) -> None:
        """A group collides if a new contact approaches, or any while an impulse is being spread;
        then all that do."""
        self.group = paper.linked(self.m, self.contacts)
        of = [self.of(self.group, c) for c in self.contacts]
        near = self.speeds < -self.scene.contact.approach_velocity
        spreads = {self.group[tree] for tree in spreading}
        struck = {
            g
            for i, g in enumerate(of)
            if self.law.impulses and near[i] and (self.new[i] or g in spreads)
        }
        self.states = [
            COLLIDING if g in struck else RESTING if g in of else FREE for g in self.group
        ]
        self.collides = [i for i, g in enumerate(of) if g in struck and near[i]]

    def check_set(self) -> None:
        np.testing.assert_allclose(self.table["normal_velocity"], self.speeds, atol=ROUNDING)
        assert self.table["is_new"].tolist() == self.new
        hardest = next((state for state in (COLLIDING, RESTING) if state in self.states), FREE)
        tool = self.system.tool_tree
        assert self.run.state[self.k] == (self.states[tool] if tool >= 0 else hardest)

    def rows(self, chosen: list[int]) -> tuple[np.ndarray, list[int]]:
        """J_c and the contact of each row: (11), (12), or both rows of (13)-(14)."""
        rows = []
        owner = []
        for i in chosen:
            c = self.contacts[i]
            both = self.scene.contact.self_collision_rows == "per_body"
            if both and c.bodies[1] >= 0:
                rows += [
                    c.normal @ self.m.point_jacobian(self.q, body, c.point) for body in c.bodies
                ]
                owner += [i, i]
            else:
                rows.append(c.normal @ self.jacobians[i])
                owner.append(i)
        return np.array(rows).reshape(-1, self.m.nv), owner

    def resolved(
        self, J: np.ndarray, M: np.ndarray, v: np.ndarray, chosen: list[int], dofs: Any, line: int
    ) -> Any:
        """(v⁺, p, friction share, solved): by (20)-(21), Poisson's law or with friction."""
        values = [paper.own_values(self.scene, self.contacts[i]) for i in chosen]
        e = np.array([value[0] for value in values])
        if self.law.friction_in_impacts:
            space = paper.in_space(self.scene)
            T = np.array(
                [
                    paper.tangents_of(self.contacts[i].normal, space) @ self.jacobians[i][:, dofs]
                    for i in chosen
                ]
            )
            found = resolve_frictional_impact(M, J, T, v, e[0], [value[1] for value in values])
            solved = found.status in ("complete", "scaled")
            return found.velocity, found.impulses, found.friction_share, solved
        if self.law.pushing or len(set(e)) > 1:
            found = resolve_impact(M, J, v, e, method="poisson" if len(set(e)) == 1 else "factored")
            return found.velocity, found.impulses, 1.0, True
        return *paper.impact(M, J, v, e[0]), 1.0, True

    def check_impulses(self) -> tuple[np.ndarray, set[int]]:
        """Every line of the step's impacts; return v⁺ and the trees with an impulse still to be
        spread."""
        scales = (
            getattr(self.law, "rendering", "full") in ("scale", "spread")
            and self.scene.device is not None
        )
        island = (
            self.group
            if scales
            else paper.linked(self.m, [self.contacts[i] for i in self.collides])
        )
        roots = sorted({self.of(island, self.contacts[i]) for i in self.collides})
        log = self.run.impacts
        lines = np.flatnonzero(self.run.impacts.step == self.k)
        assert log.group[lines].tolist() == roots
        v_plus = self.v.copy()
        spreading = set[int]()
        p_of = np.zeros(len(self.contacts))
        for line, root in zip(lines, roots, strict=True):
            trees = [t for t, first in enumerate(island) if first == root]
            dofs = np.concatenate([np.arange(*self.m.tree_dofs[t]) for t in trees])
            chosen = [i for i in self.collides if self.of(island, self.contacts[i]) == root]
            J, owner = self.rows(chosen)
            J = J[:, dofs]
            M = self.m.mass_matrix(self.q)[np.ix_(dofs, dofs)]
            v = self.v[dofs]
            after, p, kept, solved = self.resolved(J, M, v, chosen, dofs, line)
            asked = M @ (after - v)
            share = 1.0
            if scales:
                limit = np.full(self.m.nv, np.inf)
                limit[slice(*self.system.tool_dofs)] = self.scene.device.force_limit
                force = np.abs(asked) / self.system.dt
                share = float(np.min(limit[dofs] / np.maximum(force, 1e-300), initial=1.0))
                assert np.all(np.abs(log.impulse[line, dofs]) / self.system.dt <= limit[dofs])
            size = np.abs(self.v).max()
            np.testing.assert_allclose(log.v_minus[line], v_plus, atol=ROUNDING * size)
            v_plus[dofs] = v + share * (after - v)
            np.testing.assert_allclose(log.v_plus[line], v_plus, atol=ROUNDING * size)
            spreading |= set(trees) if share < 1.0 and self.law.rendering == "spread" else set()
            for row, i in enumerate(owner):
                if row == 0 or owner[row - 1] != i:  # of two rows that on body a
                    p_of[i] = share * p[row]
            assert (log.solved[line], log.scale[line]) == (solved, pytest.approx(share, rel=1e-12))
            assert (log.clamp[line], log.friction_share[line]) == pytest.approx(
                (1.0, kept), abs=1e-6
            )
            self.check_line(line, J, M, v, v_plus[dofs])
        if not (self.law.pushing or self.law.friction_in_impacts):
            size = np.abs(p_of).max(initial=1e-3)
            np.testing.assert_allclose(self.table["impulse"], p_of, atol=1e-7 * size)
        return v_plus, spreading

    def check_line(
        self, line: int, J: np.ndarray, M: np.ndarray, v: np.ndarray, after: np.ndarray
    ) -> None:
        """The energy of an impact, its rows, and those that still approach."""
        log = self.run.impacts
        lost = 0.5 * (v @ M @ v - after @ M @ after)
        assert log.energy_lost[line] == pytest.approx(lost, abs=ROUNDING * (v @ M @ v))
        assert log.rows[line] == len(J)
        slow = J @ after + self.scene.contact.approach_velocity
        assert log.approaching[line] == np.count_nonzero(slow < 0.0) or np.abs(slow).min() < 1e-9

    def check_forces(self, v_plus: np.ndarray) -> None:
        """(5), (6) at what does not collide; nothing where the impulse acts."""
        penalty = np.zeros(self.m.nv)
        friction = np.zeros(self.m.nv)
        size = self.scene.contact.stiffness * 1e-3
        for i, (c, J) in enumerate(zip(self.contacts, self.jacobians, strict=True)):
            normal = self.table["normal_force"][i]
            drag = self.table["friction_force"][i]
            penalty = penalty + J.T @ c.normal * normal
            friction = friction + J.T @ drag
            force, expected = paper.resting(self.scene, c, J, v_plus)
            if self.states[self.of(self.group, c)] == COLLIDING:
                force = 0.0
                expected = np.zeros(3)
            assert normal == pytest.approx(force, rel=1e-6, abs=1e-6 * size)
            np.testing.assert_allclose(drag, expected, atol=ROUNDING * size)
        np.testing.assert_allclose(self.run.penalty_force[self.k], penalty, atol=1e-6)
        np.testing.assert_allclose(self.run.friction_force[self.k], friction, atol=1e-9)

    def check_motion(self, v_plus: np.ndarray) -> None:
        """(7) with the record's forces, by semi-implicit Euler."""
        h = self.system.dt
        run = self.run
        k = self.k
        force = (
            run.hand_force[k] + run.coupling_force[k] + run.penalty_force[k] + run.friction_force[k]
        )
        force = force - self.m.gravity(self.q, self.system.gravity) - self.m.bias(self.q, v_plus)
        after = v_plus + h * np.linalg.solve(self.m.mass_matrix(self.q), force)
        q = self.m.integrate(self.q, after, h)
        np.testing.assert_allclose(
            run.v[k + 1], after, atol=ROUNDING * max(1.0, np.abs(after).max())
        )
        np.testing.assert_allclose(
            run.q[k + 1], q, atol=h * ROUNDING * max(1.0, np.abs(after).max())
        )


@pytest.mark.parametrize("name", CASES)
def test_every_step_is_the_papers(name: str) -> None:
    scene, law = scene_and_law(CASES[name])
    run = simulate(scene, law)
    system = System(scene)
    law = law.within(system.scene)
    before = list[paper.Contact]()
    spreading = set[int]()
    seen = set[int]()
    assert run.complete
    for k in range(run.steps):
        step = Step(system, law, run, k, before, spreading)
        step.check_set()
        v_plus, spreading = step.check_impulses()
        step.check_forces(v_plus)
        if law.integrator == "semi_implicit_euler":
            step.check_motion(v_plus)
        before = step.contacts
        seen = seen | set(step.states)
    assert certify(run).passed  # momentum, energy, and the sums of each step
    assert COLLIDING in seen if law.impulses else RESTING in seen
    assert RESTING in seen or "cradle" in name
    assert getattr(law, "rendering", "full") == "full" or (run.impacts.scale < 1.0).any()
