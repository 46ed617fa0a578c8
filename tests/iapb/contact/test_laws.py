"""The engine's laws, judged from the records of their runs: impacts, limits, resting forces, orders, energy."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.contact.laws import RENDERINGS, ImpulseAugmented, Penalty
from iapb.errors import ArgumentError
from iapb.mechanics.integrators import INTEGRATORS
from iapb.run import COLLIDING, FREE, RESTING
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from iapb.system import System, coupling_of

PEG = load_scene(find_scene("peg_corner")).with_values({
    "bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "device.force_limit": [3, 3, 0.05],
    "duration": 1.5,
})
LIMIT = np.array([3.0, 3.0, 0.05])
SCENES = {
    "peg_plastic": PEG,
    "peg_elastic": PEG.with_values({"contact.restitution": 0.7}),
    **{name: load_scene(find_scene(name))
       for name in ("peg_hole", "arm_pushing", "newton_cradle", "two_discs", "three_link_arm_elastic")},
}
# Each quantity is a sum of a dozen products of doubles; the arm's inertia has a condition number of some hundreds.
ROUNDING = 1e-11


def relative_rows(run, mechanism, step):
    """(nᵀ(J_a − J_b), their contacts) of all contacts of a step, without the engine's kernels."""
    table, q = run.contacts, run.q[step]
    rows = []
    chosen = range(table.offsets[step], table.offsets[step + 1])
    for i in chosen:
        row = table.normal[i] @ mechanism.point_jacobian(q, int(table.body_a[i]), table.point[i])
        if table.body_b[i] >= 0:
            row = row - table.normal[i] @ mechanism.point_jacobian(q, int(table.body_b[i]), table.point[i])
        rows.append(row)
    return np.array(rows).reshape(-1, mechanism.nv), np.array(chosen, int)


@pytest.mark.parametrize("rendering", RENDERINGS)
@pytest.mark.parametrize("name", SCENES)
def test_every_impact_balances_momentum_restitution_and_energy(name, rendering):
    scene = SCENES[name]
    system = System(scene)
    run = simulate(scene, ImpulseAugmented(rendering=rendering))
    e, slow, impacts = scene.contact.restitution, scene.contact.approach_velocity, run.impacts
    assert len(impacts.step) > 0
    for k in range(len(impacts.step)):
        step, before, after = impacts.step[k], impacts.v_minus[k], impacts.v_plus[k]
        mass = system.mechanism.mass_matrix(run.q[step])
        size = np.abs(mass) @ np.abs(before)
        assert mass @ (after - before) == pytest.approx(impacts.impulse[k], abs=ROUNDING * size.max())
        kinetic = 0.5 * before @ mass @ before
        lost = kinetic - 0.5 * after @ mass @ after
        assert impacts.energy_lost[k] == pytest.approx(lost, abs=ROUNDING * kinetic)
        assert impacts.energy_lost[k] >= -1e-14 * kinetic  # passive, to the rounding of this sum
        rows, chosen = relative_rows(run, system.mechanism, step)
        rates = run.contacts.normal_velocity[chosen]
        mine = (rates < -slow) & (run.contacts.impulse[chosen] != 0.0)
        share = impacts.scale[k] * (1.0 + e)
        group = mine if len(np.flatnonzero(impacts.step == step)) == 1 else mine & (rows @ (after - before) != 0.0)
        assert group.any()
        assert rows @ run.v[step] == pytest.approx(rates, abs=ROUNDING)
        assert rows[group] @ after == pytest.approx((1.0 - share) * (rows[group] @ before), abs=ROUNDING)


@pytest.mark.parametrize("name", SCENES)
def test_impulses_of_a_step_are_those_of_its_contacts(name):
    scene = SCENES[name]
    mechanism, run = System(scene).mechanism, simulate(SCENES[name])
    for step in np.unique(run.impacts.step):
        rows, chosen = relative_rows(run, mechanism, step)
        assert rows.T @ run.contacts.impulse[chosen] == pytest.approx(run.impulse[step], abs=ROUNDING)
        assert run.impacts.impulse[run.impacts.step == step].sum(axis=0) == pytest.approx(run.impulse[step], abs=0.0)
    quiet = np.setdiff1d(np.arange(run.steps), run.impacts.step)
    assert not run.impulse[quiet].any()


def test_with_per_body_rows_the_recorded_impulse_is_the_one_on_the_first_body():
    scene = SCENES["two_discs"].with_values({"contact.self_collision_rows": "per_body"})
    run = simulate(scene)
    step = run.impacts.step[0]
    i = run.contacts.offsets[step]
    on_a = slice(3 * run.contacts.body_a[i], 3 * run.contacts.body_a[i] + 2)
    assert run.contacts.impulse[i] * run.contacts.normal[i, :2] == pytest.approx(run.impulse[step, on_a], abs=1e-12)
    assert abs(run.impulse[step, 0] + run.impulse[step, 3]) > 1.0  # erratum 3: momentum is lost


def groups_approach(run, slow, step):
    table = run.contacts
    rows = slice(table.offsets[step], table.offsets[step + 1])
    return table.normal_velocity[rows] < -slow, table.is_new[rows]


@pytest.mark.parametrize("e", [0.0, 0.7])
def test_the_scale_respects_the_limits_exactly_and_is_no_smaller_than_needed(e):
    scene = PEG.with_values({"contact.restitution": e})
    for rendering in ("scale", "spread"):
        run = simulate(scene, ImpulseAugmented(rendering=rendering))
        force = np.abs(run.impacts.impulse) / run.dt
        assert np.all(force <= LIMIT)
        scaled = run.impacts.scale < 1.0
        assert scaled.any()
        assert np.max(force / LIMIT, axis=1)[scaled] == pytest.approx(1.0, rel=1e-14)
        # unscaled, the same impulse would have exceeded the limit
        assert np.all(np.max(force / LIMIT, axis=1)[scaled] / run.impacts.scale[scaled] > 1.0)


def test_spreading_goes_on_while_a_contact_approaches_and_scaling_does_not():
    slow = PEG.contact.approach_velocity
    longest = {}
    for rendering in ("scale", "spread"):
        run = simulate(PEG, ImpulseAugmented(rendering=rendering))
        scale = dict(zip(run.impacts.step, run.impacts.scale, strict=True))
        unfinished = [step for step, share in scale.items() if share < 1.0 and step + 1 < run.steps]
        assert unfinished
        for step in unfinished:
            approach, new = groups_approach(run, slow, step + 1)
            expected = approach.any() if rendering == "spread" else (approach & new).any()
            assert (run.state[step + 1] == COLLIDING) == expected
        colliding = run.state == COLLIDING
        longest[rendering] = np.max(np.diff(np.flatnonzero(np.diff(np.concatenate([[0], colliding, [0]]))))[::2])
    assert longest["spread"] > longest["scale"]


def test_saturation_clips_the_device_and_nothing_else():
    from iapb.system import coupling_of

    coupling = coupling_of(PEG, "four-channel")
    run = simulate(PEG, ImpulseAugmented(rendering="saturate"), coupling)
    asked = run.environment_force - run.coupling_force
    assert np.all(run.impacts.scale == 1.0)
    assert run.device_force == pytest.approx(np.clip(asked, -LIMIT, LIMIT), abs=1e-12)
    assert np.any(np.abs(run.environment_force) > LIMIT)
    # without a device saturation changes nothing at all
    alone = [simulate(PEG, ImpulseAugmented(rendering=rendering)).q for rendering in ("full", "saturate")]
    assert np.array_equal(*alone)


def test_without_limits_all_renderings_are_one():
    scene = PEG.with_values({"device": None})
    first, *others = [simulate(scene, ImpulseAugmented(rendering=rendering)) for rendering in RENDERINGS]
    assert all(np.array_equal(first.q, other.q) for other in others)


# --- C09 --------------------------------------------------------------------------------------------------------------


def with_restitution(scene, e):
    """A scene with an e that scene files do not allow: e = −1 takes the impulses away (section VI)."""
    return scene.model_copy(update={"contact": scene.contact.model_copy(update={"restitution": e})})


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_restitution_minus_one_is_the_penalty_law_bit_for_bit(name, integrator):
    gone = simulate(with_restitution(SCENES[name], -1.0), ImpulseAugmented(integrator))
    penalty = simulate(SCENES[name], Penalty(integrator))
    for field in ("q", "v", "penalty_force", "friction_force", "impulse", "state"):
        assert np.array_equal(getattr(gone, field), getattr(penalty, field)), field
    assert len(gone.impacts.step) == 0 and not np.any(penalty.state == COLLIDING)
    assert np.any(penalty.state == RESTING)
    assert not np.array_equal(penalty.q, simulate(SCENES[name], ImpulseAugmented(integrator)).q)


# --- resting ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["peg_plastic", "arm_pushing"])
def test_resting_forces_are_those_of_the_recorded_contacts(name):
    """(5) at every contact of a group that does not collide, and none while it collides."""
    scene = SCENES[name]
    mechanism, run = System(scene).mechanism, simulate(scene)
    contact, rested = scene.contact, 0
    for step in range(run.steps):
        rows, chosen = relative_rows(run, mechanism, step)
        if run.state[step] == COLLIDING or len(chosen) == 0:
            assert not run.penalty_force[step].any() or name == "arm_pushing"
            continue
        gap, rate = run.contacts.gap[chosen], run.contacts.normal_velocity[chosen]
        force = np.maximum(-contact.stiffness * gap - contact.damping * rate, 0.0)
        assert rows.T @ force == pytest.approx(run.penalty_force[step], abs=1e-9)
        assert force == pytest.approx(run.contacts.normal_force[chosen], abs=1e-9)
        rested += 1
    assert rested > 10 and np.any(run.state == FREE)


@pytest.mark.parametrize("integrator", ["midpoint", "runge_kutta_4"])
def test_inner_stages_cluster_contacts_too(integrator):
    """Two walls at one place are one contact after clustering: the same motion as with one wall."""
    scene = load_scene(find_scene("wall_1d")).with_values({"contact.cluster_distance": 1e-6})
    wall = {"kind": "half_plane", "point": [0, 0], "normal": [-1, 0]}
    twice = scene.with_values({"walls": [{**wall, "name": "wall"}, {**wall, "name": "again"}]})
    single, double, unfiltered = (simulate(each, Penalty(integrator)) for each in (
        scene, twice, twice.with_values({"contact.cluster_distance": 0})))
    assert np.array_equal(single.q, double.q)
    assert not np.array_equal(single.q, unfiltered.q)


# --- arguments --------------------------------------------------------------------------------------------------------


def test_settings_that_do_not_exist_are_named():
    with pytest.raises(ArgumentError, match="integrator = 'euler': expected one of momentum, semi_implicit_euler"):
        Penalty("euler")
    with pytest.raises(ArgumentError, match="rendering = 'clip': expected one of full, saturate, scale, spread"):
        ImpulseAugmented(rendering="clip")


def test_a_step_other_than_the_scenes_is_refused():
    system = System(PEG)
    with pytest.raises(ArgumentError, match="dt = 0.1: expected the step of the scene"):
        Penalty().advance(system, system.make_state(), np.zeros(3), 0.1)


WHOLE_PEG = load_scene(find_scene("peg_corner")).with_values({
    "bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "duration": 1.5,
    "contact.coherence_distance": 1e-3,
})
PENDULUM = load_scene(find_scene("double_pendulum")).with_values({"duration": 0.5})


def final_state(integrator, rate):
    run = simulate(PENDULUM.with_values({"rate": rate}), Penalty(integrator))
    return np.concatenate([run.q[-1], run.v[-1]]), run.energy["integration_residual"]


@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=lambda each: each.name)
def test_the_compiled_step_has_the_declared_order_on_a_smooth_scene(integrator):
    truth, _ = final_state("runge_kutta_4", 8000)
    rates = (400, 800, 1600)
    errors = [np.linalg.norm(final_state(integrator.name, rate)[0] - truth) for rate in rates]
    measured = np.log2(np.divide(errors[:-1], errors[1:]))
    # under gravity alone `momentum` is better than it declares
    assert measured[-1] == pytest.approx(integrator.order + integrator.conserving, abs=0.25)


@pytest.mark.parametrize("integrator", INTEGRATORS.values(), ids=lambda each: each.name)
def test_the_energy_ledger_closes_to_the_order_of_the_integrator(integrator):
    largest = [np.abs(final_state(integrator.name, rate)[1]).max() for rate in (400, 800)]
    assert np.log2(largest[0] / largest[1]) >= integrator.order - 0.25
    assert largest[0] > 1e-13  # there is something to measure


@pytest.mark.parametrize("coupling", ["none", "four-channel"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_with_contacts_the_ledger_closes_as_the_step_goes_to_zero(integrator, coupling):
    """Collisions, penalties, friction, hand and coupling: nothing is forgotten. Contacts leave order 1 at best."""
    residuals = []
    for rate in (1000, 8000):
        scene = WHOLE_PEG.with_values({"rate": rate})
        run = simulate(scene, ImpulseAugmented(integrator), coupling_of(scene, coupling))
        ledger = run.energy
        through = np.abs(ledger["hand_work"]).max() + np.abs(ledger["impact_loss"]).max()
        residuals.append(np.abs(ledger["integration_residual"]).max() / through)
    assert residuals[1] < residuals[0] / 4.0
    assert residuals[1] < 0.01
