"""The engine's laws over whole runs: e = −1, renderings, bystanders, equal values, orders and the
energy ledger."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iapb.contact.laws import INTEGRATORS, ImpulseAugmented, Penalty
from iapb.run import COLLIDING, RESTING
from iapb.scene import Scene, find_scene, load_scene
from iapb.simulation import simulate
from iapb.system import coupling_of

HERE = Path(__file__).parent


def shipped(name: str) -> Scene:
    return load_scene(find_scene(name))


START = {"bodies.peg.position": [0.0209, -0.0141, 0.08], "contact.friction": 0.1, "duration": 1.5}
LIMIT = np.array([3.0, 3.0, 0.05])
PEG = shipped("peg_corner").with_values(START | {"device.force_limit": LIMIT.tolist()})
SCENES = {
    "peg": PEG,
    "elastic peg": PEG.with_values({"contact.restitution": 0.7}),
    **{
        name: shipped(name)
        for name in ("peg_hole", "arm_pushing", "newton_cradle", "three_link_arm_elastic")
    },
}


# --- C09 and the renderings of section VI
# ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_restitution_minus_one_is_the_penalty_law_bit_for_bit(name: str, integrator: str) -> None:
    """C09, with an e that scene files do not allow."""
    scene = SCENES[name]
    contact = scene.contact.model_copy(update={"restitution": -1.0})
    gone = simulate(scene.model_copy(update={"contact": contact}), ImpulseAugmented(integrator))
    penalty = simulate(scene, Penalty(integrator))
    for field in ("q", "v", "penalty_force", "friction_force", "impulse", "state"):
        assert np.array_equal(getattr(gone, field), getattr(penalty, field)), field
    assert len(gone.impacts.step) == 0 and not np.any(penalty.state == COLLIDING)
    assert np.any(penalty.state == RESTING)
    assert not np.array_equal(penalty.q, simulate(scene, ImpulseAugmented(integrator)).q)


def test_saturation_clips_the_device_and_nothing_else() -> None:
    run = simulate(PEG, ImpulseAugmented(rendering="saturate"), coupling_of(PEG, "four-channel"))
    asked = run.environment_force - run.coupling_force
    assert np.all(run.impacts.scale == 1.0)
    assert run.device_force == pytest.approx(np.clip(asked, -LIMIT, LIMIT), abs=1e-12)
    assert np.any(np.abs(run.environment_force) > LIMIT)
    alone = [
        simulate(PEG, ImpulseAugmented(rendering=rendering)).q for rendering in ("full", "saturate")
    ]
    assert np.array_equal(*alone)  # without a device it changes nothing


@pytest.mark.parametrize(
    ("restitution", "leaves_with", "steps"), [(0.0, 0.0, 7), (0.5, 0.0025, None)]
)
def test_spreading_delivers_the_prescribed_velocity_for_plastic_impacts_only(
    restitution: float, leaves_with: float, steps: int | None
) -> None:
    """Erratum 5, with its numbers: the tool leaves with 0.0025 m/s instead of 0.05 m/s."""
    scene = load_scene(HERE / "tool.yaml").with_values({"contact.restitution": restitution})
    run = simulate(scene, ImpulseAugmented(rendering="spread"))
    assert run.v[-1, 0] == pytest.approx(leaves_with, abs=5e-5) and steps in (
        None,
        len(run.impacts.step),
    )


# --- what must change no bit
# -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_equal_restitution_changes_no_bit_wherever_it_is_written(e: float) -> None:
    plain = simulate(PEG.with_values({"contact.restitution": e}))
    walls = [wall.name for wall in PEG.walls]
    of_walls = {f"walls.{name}.restitution": e for name in walls}
    for values in (
        of_walls,
        {"bodies.peg.restitution": e},
        of_walls | {"bodies.peg.restitution": e},
    ):
        own = simulate(PEG.with_values(values | {"contact.restitution": 0.5}))
        assert np.array_equal(own.q, plain.q) and np.array_equal(
            own.impacts.impulse, plain.impacts.impulse
        )


# --- energy over a run
# -----------------------------------------------------------------------------------------------

BAR = shipped("bar_on_posts")


def test_unequal_restitution_and_friction_in_one_impact() -> None:
    """The bar on its posts, sliding: Poisson's normal impulses, Coulomb's friction; equalities gain
    12 J here."""
    law = ImpulseAugmented(friction_in_impacts=True)
    run = simulate(BAR.with_values({"contact.friction": 0.5, "bodies.bar.velocity.0": 1.0}), law)
    found = run.impacts
    assert found.energy_lost.min() >= -1e-15 and not found.approaching.any() and found.solved.all()
    assert found.rows[0] == 2 and 0.0 <= found.v_plus[0, 0] < 1.0


# --- orders
# ----------------------------------------------------------------------------------------------------------

PENDULUM = shipped("double_pendulum").with_values({"duration": 0.5})


def pendulum(integrator: str, rate: float) -> tuple[Any, Any]:
    run = simulate(PENDULUM.with_values({"rate": rate}), Penalty(integrator))
    return np.concatenate([run.q[-1], run.v[-1]]), run.energy["integration_residual"]


@pytest.mark.parametrize(("integrator", "order"), [("momentum", 2), ("semi_implicit_euler", 1)])
def test_the_compiled_step_has_its_order_on_a_smooth_scene(integrator: str, order: int) -> None:
    """Under gravity alone `momentum` has order 2."""
    truth, _ = pendulum("momentum", 32000)
    errors = [np.linalg.norm(pendulum(integrator, rate)[0] - truth) for rate in (400, 800, 1600)]
    measured = np.log2(np.divide(errors[:-1], errors[1:]))
    assert measured[-1] == pytest.approx(order, abs=0.25)
    largest = [np.abs(pendulum(integrator, rate)[1]).max() for rate in (400, 800)]
    assert np.log2(largest[0] / largest[1]) >= 0.75
    assert largest[0] > 1e-13


@pytest.mark.parametrize("coupling", ["none", "four-channel"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_with_contacts_the_ledger_closes_as_the_step_goes_to_zero(
    integrator: str, coupling: str
) -> None:
    """Collisions, penalties, friction, hand and coupling: nothing is forgotten. Contacts leave
    order 1 at best."""
    residuals = []
    for rate in (1000, 8000):
        scene = shipped("peg_corner").with_values(
            START | {"contact.coherence_distance": 1e-3, "rate": rate}
        )
        ledger = simulate(scene, ImpulseAugmented(integrator), coupling_of(scene, coupling)).energy
        through = np.abs(ledger["hand_work"]).max() + np.abs(ledger["impact_loss"]).max()
        residuals.append(np.abs(ledger["integration_residual"]).max() / through)
    assert residuals[1] < residuals[0] / 4.0 and residuals[1] < 0.01


TILES = load_scene(HERE / "tiles.yaml")


@pytest.mark.parametrize("forces", ["paper", "implicit"])
def test_a_box_on_a_hard_and_a_soft_tile_turns_whichever_comes_first(forces: str) -> None:
    """Its left side bounces. Friction changes no normal velocity of the contacts that stay."""
    given = {"contact.forces": forces, "contact.stiffness": 1e4, "contact.damping": 10.0}
    scene = TILES.with_values(given)
    turned = scene.with_values({"walls": scene.resolved()["walls"][::-1]})
    first = simulate(scene).impacts.v_plus[0]
    other = simulate(turned).impacts.v_plus[0]
    np.testing.assert_allclose(first, other, atol=1e-12)
    assert first[2] < -1.0 and 0.0 < first[1] < 0.8
    if forces == "paper":
        rough = simulate(scene, ImpulseAugmented(friction_in_impacts=True)).impacts.v_plus[0]
        np.testing.assert_allclose(rough[1:], first[1:], atol=1e-12)
        assert rough[0] < first[0] - 0.1
