"""Restitution by body and wall: the rule for a pair, the scalar rule where all are alike, Poisson's law where not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iapb import decide_effects, resolve_impact
from iapb.mechanics.energy import Floats
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from iapb.scene.mechanism import mechanism_of, pairs_of, restitution_by_pair, shapes_of
from iapb.simulation import simulate

BAR, PEG, DISCS = (load_scene(find_scene(name)) for name in ("bar_on_posts", "peg_corner", "two_discs"))


def rows_of(scene: Scene, run: Run, impact: int) -> tuple[Floats, Floats, Floats]:
    """M, J and e of a recorded impact, from the run and the scene alone."""
    mechanism, step, contacts = mechanism_of(scene), run.impacts.step[impact], run.contacts
    q, rows, e = run.q[step], [], []
    own = {body.name: body.restitution for body in scene.bodies} | {wall.name: wall.restitution for wall in scene.walls}
    for i in range(contacts.offsets[step], contacts.offsets[step + 1]):
        if contacts.gap[i] <= 0.0 and contacts.normal_velocity[i] < -scene.contact.approach_velocity:
            jacobian = mechanism.point_jacobian(q, contacts.body_a[i], contacts.point[i])
            rows.append(contacts.normal[i] @ jacobian)
            near = contacts.point[i, 0] < 0.45
            e.append(own["near" if near else "far"])
    return mechanism.mass_matrix(q), np.array(rows), np.array(e)


def kinetic(scene: Scene, q: Floats, v: Floats) -> float:
    return float(mechanism_of(scene).kinetic_energy(q, v))


def test_the_bar_as_a_scene_is_passive_where_equalities_gain_12_joules() -> None:
    """KE 0.5 J before; by equalities 12.167 J after; by the engine no more than before, in the impact and after it."""
    run = simulate(BAR)
    M, J, e = rows_of(BAR, run, 0)
    v = run.impacts.v_minus[0]
    wrong = v + np.linalg.solve(M, J.T @ np.linalg.solve(J @ np.linalg.solve(M, J.T), -(J @ v) * (1.0 + e)))
    assert kinetic(BAR, run.q[0], v) == pytest.approx(0.5, rel=1e-12)
    assert kinetic(BAR, run.q[0], wrong) == pytest.approx(12.1666667, rel=1e-6)
    assert run.impacts.rows[0] == 2 and run.impacts.solved.all() and not run.impacts.approaching.any()
    assert run.impacts.energy_lost.min() >= 0.0
    assert run.energy["kinetic"].max() <= 0.5 * (1.0 + 1e-12)


def test_the_compiled_impact_is_the_functions() -> None:
    """`resolve_impact` with one e per contact, on the rows that the run records."""
    run = simulate(BAR)
    M, J, e = rows_of(BAR, run, 0)
    found = resolve_impact(M, J, run.impacts.v_minus[0], e)
    assert found.law == "Poisson, two LCPs" and found.rank == run.impacts.rank[0]
    np.testing.assert_allclose(run.impacts.v_plus[0], found.velocity, rtol=0, atol=1e-14)
    np.testing.assert_allclose(run.impacts.impulse[0], found.generalized_impulse, rtol=0, atol=1e-14)
    first = slice(run.contacts.offsets[run.impacts.step[0]], run.contacts.offsets[run.impacts.step[0] + 1])
    np.testing.assert_allclose(np.sort(run.contacts.impulse[first]), np.sort(found.impulses), rtol=0, atol=1e-14)


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_equal_values_change_no_bit_wherever_they_are_written(e: float) -> None:
    plain = simulate(PEG.with_values({"contact.restitution": e}))
    walls = {f"walls.{wall.name}.restitution": e for wall in PEG.walls}
    for values in (walls, {"bodies.peg.restitution": e}, {**walls, "bodies.peg.restitution": e}):
        own = simulate(PEG.with_values({"contact.restitution": 0.5, **values}))
        assert np.array_equal(own.q, plain.q) and np.array_equal(own.impacts.impulse, plain.impacts.impulse)


def test_an_impact_of_contacts_alike_is_the_scalar_rule_though_others_differ() -> None:
    """The effect is on, but the first collision meets one wall only: bit for bit that wall's restitution."""
    values = {wall.name: e for wall, e in zip(PEG.walls, (0.2, 0.8), strict=False)}
    unequal = PEG.with_values({f"walls.{name}.restitution": e for name, e in values.items()})
    assert _effect(unequal).active
    mixed = simulate(unequal, steps=400)
    alike = [simulate(PEG.with_values({"contact.restitution": e}), steps=400) for e in values.values()]
    first = mixed.impacts.step[0] + 1
    assert any(np.array_equal(mixed.v[: first + 1], run.v[: first + 1]) for run in alike)


def _effect(scene: Scene) -> Any:
    return next(effect for effect in decide_effects(scene) if effect.name == "unequal_restitution")


@pytest.mark.parametrize(
    ("one", "other", "pair"),
    [(None, None, 0.4), (0.9, None, 0.9), (None, 0.1, 0.1), (0.9, 0.1, 0.1), (0.0, 1.0, 0.0)],
)
def test_the_smaller_of_two_counts_and_silence_takes_the_others(one: Any, other: Any, pair: float) -> None:
    scene = DISCS.with_values({"contact.restitution": 0.4, "bodies.striker.restitution": one,
                               f"bodies.{DISCS.bodies[1].name}.restitution": other})
    assert restitution_by_pair(scene, pairs_of(scene, shapes_of(scene))) == [pair]
    assert not _effect(scene).active
    run = simulate(scene)
    before, after = (np.diff(run.impacts.__dict__[name][0][[0, 3]])[0] for name in ("v_minus", "v_plus"))
    assert after == pytest.approx(-pair * before, rel=1e-12, abs=1e-15)


@settings(max_examples=25)
@given(st.tuples(*[st.floats(0.0, 1.0)] * 2), st.floats(-0.02, 0.02), st.floats(-3.0, 3.0))
def test_a_bar_on_any_two_posts_never_gains(e: tuple[float, float], tilt: float, spin: float) -> None:
    values = {"walls.near.restitution": e[0], "walls.far.restitution": e[1], "bodies.bar.position.2": tilt,
              "bodies.bar.velocity.2": spin, "contact.stiffness": 0, "contact.damping": 0}
    run = simulate(BAR.with_values(values))
    before = run.energy["kinetic"][0]
    assert np.diff(run.energy["kinetic"]).max() <= 1e-13 * before
    assert not run.impacts.approaching.any() and run.impacts.solved.all()


def test_in_space_too() -> None:
    """A box on two floors' halves of its own: two balls under it, one soft, one hard."""
    scene = load_scene(find_scene("peg_hole_space"))
    names = [wall.name for wall in scene.walls]
    run = simulate(scene.with_values({f"walls.{names[0]}.restitution": 0.9}), steps=200)
    assert run.impacts.energy_lost.min() > -1e-15 and run.impacts.solved.all()
    assert any(effect.name == "unequal_restitution" and effect.active for effect in run.effects)
