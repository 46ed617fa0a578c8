"""The reference's mechanics: free motion against closed forms and beside the engine's, by
Pinocchio.

The truth of events has no friction, so only the world "ideal-friction" is asked to roll.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from iapb.errors import ArgumentError, SolverError
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene import Scene, find_scene, load_scene, scene_names
from iapb.scene.mechanism import mechanism_of
from iapb.simulation import simulate
from reference import rigid_body
from reference.free_motion import free_motion
from reference.random_mechanisms import random_mechanism
from reference.rigid_body import model_of
from reference.scene_events import scene_truth
from reference.time_stepping import RigidConstraints
from tests.reference.scenes import G, scene_of

Floats = NDArray[np.float64]
UPRIGHT = [0.0, 0.0, 0.0, 1.0]


def by_events(scene: Scene, duration: float) -> tuple[Floats, Floats, Floats]:
    """Return times (n,), q (n, nq) and v (n, d) of the event-driven truth."""
    time = np.linspace(0.0, duration, 21)
    return time, *scene_truth(scene, duration).state(time)


# --- torque-free motion
# ------------------------------------------------------------------------------------------


def test_floating_trees_that_turn_keep_momentum_and_energy() -> None:
    """Random trees on a free flyer, in free motion for 0.1 s at up to 30 rad/s."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        tree = random_mechanism(rng, 3, ("revolute", "spherical")).bodies
        base = Body(
            "base", None, Joint("free_flyer"), mass=20.0, inertia=np.diag([20.0, 30.0, 40.0])
        )
        mechanics = model_of(
            Mechanism([base, *(replace(body, parent=body.parent or "base") for body in tree)])
        )
        q = mechanics.normalize(np.ones(mechanics.nq))
        v = rng.uniform(-30.0, 30.0, mechanics.nv)
        energy = mechanics.kinetic_energy(q, v)
        momentum = mechanics.centroidal_momentum(q, v)
        for _ in range(100):
            q, v = free_motion(mechanics, q, v, 1e-3)
        assert mechanics.kinetic_energy(q, v) == pytest.approx(energy, rel=1e-10)
        assert mechanics.centroidal_momentum(q, v) == pytest.approx(
            momentum, abs=1e-10 * np.abs(momentum).max()
        )


# --- with gravity and contact
# -------------------------------------------------------------------------------------


RADIUS = 0.0285


@pytest.mark.parametrize(("turning", "share"), [(2.0 / RADIUS, 1.0), (-2.0 / RADIUS, 3.0 / 7.0)])
def test_a_billiard_ball_ends_rolling(turning: float, share: float) -> None:
    """At 2 m/s, rolling, sliding, with back spin: v = (5 v₀ + 2 ω₀ r)/7 and x = v t + (v₀ − v)²/(2
    μ g).

    Sliding ends within a step of 1 ms, so the way errs by at most μ g Δt²/8.
    """
    scene = scene_of("billiard ball", bodies__ball__velocity=[2, 0, 0, 0, turning, 0])
    run = simulate(scene, RigidConstraints(friction="coulomb"), steps=650)
    slid = (2.0 - 2.0 * share) ** 2 / (2.0 * 0.2 * G)
    assert run.q[-1, :3] == pytest.approx(
        [0.65 * 2.0 * share + slid, 0.0, RADIUS], abs=1e-9 + 0.2 * G * 1e-6 / 8.0
    )
    assert np.linalg.norm(run.v[-1, :3]) == pytest.approx(2.0 * share, rel=1e-9)
    assert np.linalg.norm(run.v[-1, 3:]) * RADIUS == pytest.approx(2.0 * share, rel=1e-9)


def test_an_eccentric_disc_that_turns_fast_stays_on_the_floor() -> None:
    """No friction: (I + m c² cos² θ) θ'²/2 − m g c sin θ is constant, and the height is r − c sin
    θ.

    Gravity holds it down against c θ'². The truth keeps the contact by an acceleration, J̇v, found
    by differences.
    """
    spin = 1000.0
    mass = 1.0
    inertia = 2e-3
    radius = 0.05
    arm = 0.01
    gravity = 0.024 * spin**2
    scene = scene_of("eccentric disc")
    _, q, v = by_events(scene, 10.0 / spin)
    angle = q[:, 2]
    rate = v[:, 2]
    assert q[:, 1] == pytest.approx(radius - arm * np.sin(angle), abs=1e-10)
    energy = 0.5 * (
        inertia + mass * arm**2 * np.cos(angle) ** 2
    ) * rate**2 - mass * gravity * arm * np.sin(angle)
    assert energy == pytest.approx(energy[0], rel=1e-9)


# --- mechanisms without velocity terms, and limits
# ----------------------------------------------------------------
def test_bias_is_found_where_it_is_and_nowhere_else() -> None:
    """By trial here, by the structure of the mechanism in the engine: two ways to the same
    answer."""
    found = [mechanism_of(load_scene(find_scene(name))) for name in scene_names()]
    found += [random_mechanism(np.random.default_rng(seed), 1 + seed % 3) for seed in range(40)]
    assert {(m.has_velocity_terms, model_of(m).has_bias) for m in found} <= {
        (True, True),
        (False, False),
    }


def test_a_motion_too_fast_for_the_step_is_an_error() -> None:
    mechanics = model_of(
        Mechanism(
            [Body("top", None, Joint("spherical"), mass=1.0, inertia=np.diag([1e-3, 2e-3, 2.8e-3]))]
        )
    )
    with pytest.raises(SolverError, match="too fast for a step of 0.001 s"):
        free_motion(mechanics, np.array(UPRIGHT), np.array([3e7, 1e7, 1e7]), 1e-3)


def test_a_model_in_another_order_and_an_unknown_body_are_refused() -> None:
    root, left, right, hand = (
        Body(name, parent, Joint("revolute"), mass=1.0, inertia=np.eye(3))
        for name, parent in (("root", None), ("left", "root"), ("right", "root"), ("hand", "left"))
    )
    model = rigid_body.model_of(Mechanism([root, left, hand, right]))
    with pytest.raises(ArgumentError, match="depth-first"):
        rigid_body.model_of(Mechanism([root, left, right, hand]))
    with pytest.raises(ArgumentError, match="name of a body"):
        model.index("foot")
