"""Impacts at the moment of touch: motions between impacts are exact, so closed forms are met."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from iapb.contact.laws import ImpulseAugmented
from iapb.haptics.coupling import Coupling, FourChannel, NoCoupling
from iapb.scene import Scene, scene_from_text
from iapb.simulation import simulate
from tests.given import data_of, scene_with
from verification.certificate import certify
from verification.ordinary.touch import BOX, G, heights, toss, tossed

# Some ten impacts multiply the rounding of a touch (1e-15 m) by ten each at worst.
EXACT = 1e-8

FLOOR = "walls: [{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}]"


def toss_scene(
    state: NDArray[np.float64],
    rate: float,
    friction: float = 0.0,
    rule: str = "touch",
    restitution: float = 0.6,
    seconds: float = 0.4,
) -> Scene:
    scene = toss(state, restitution, friction, seconds)
    return scene.with_values({"rate": rate, "contact.impact_time": rule})


def states(count: int, seed: int) -> list[NDArray[np.float64]]:
    rng = np.random.default_rng(seed)
    least = [0.0, 0.1, 0.0, -1.0, -1.0, -10.0]
    most = [0.0, 0.4, 6.28, 1.0, 1.0, 10.0]
    return [rng.uniform(least, most) for _ in range(count)]


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("rate", [250.0, 1000.0])
def test_a_tossed_box_lands_where_it_should(rate: float, friction: float) -> None:
    for state in states(4, seed=2):
        scene = toss_scene(state, rate, friction)
        truth, impacts = tossed(scene)
        run = simulate(scene)
        assert np.abs(run.q[-1] - truth).max() < EXACT
        assert len(run.impacts.step) == impacts


@pytest.mark.parametrize("rate", [250.0, 1000.0])
@pytest.mark.parametrize("tilt", [0.2, -0.35])
def test_a_box_that_tips_over_one_corner_lands_on_the_other_where_that_touches(
    rate: float, tilt: float
) -> None:
    """The two bodies are in contact all the time; the second corner still strikes at gap zero."""
    state = np.array([0.0, 0.0, tilt, 0.0, 0.0, 0.0])
    state[1] = -heights(state[:3], state[3:], 0.0).min()
    run = simulate(toss_scene(state, rate, friction=1.0, restitution=0.0, seconds=0.3))
    lands = 3 if tilt > 0.0 else 2
    above = np.array([heights(q, np.zeros(3), 0.0)[lands] for q in run.impacts.q])
    assert abs(above[above < 2e-3][0]) < EXACT


def bouncing(more: str = "", rate: float = 1000.0, seconds: float = 1.0) -> str:
    return f"""name: ball
rate: {rate}
duration: {seconds}
gravity: [0, -{G}]
contact: {{restitution: 1}}
bodies:
  - {{name: ball, joint: planar, mass: 1, inertia: 0.004, position: [0, 0.2, 0],
     shapes: [{{kind: circle, radius: 0.1}}]}}
{more}{FLOOR}
"""


def test_elastic_bounces_keep_their_height() -> None:
    run = simulate(scene_from_text(bouncing(seconds=10.0)))
    fall = math.sqrt(2.0 * 0.1 / G)
    phase = (10.0 + fall) % (2.0 * fall) - fall
    assert run.q[-1, 1] == pytest.approx(0.2 - 0.5 * G * phase**2, abs=1e-10)
    assert len(run.impacts.step) == math.floor((10.0 + fall) / (2.0 * fall))
    total = run.energy["kinetic"] + run.energy["potential"]
    assert np.ptp(total) < 1e-11
    assert np.abs(run.energy["integration_residual"]).max() < 1e-11


def test_the_ledger_has_the_loss_of_an_impact_within_a_step() -> None:
    """A ball that falls by 0.1 m loses 1 − e² of that height's energy in its first bounce."""
    run = simulate(scene_from_text(bouncing().replace("restitution: 1", "restitution: 0.5")))
    first = int(run.impacts.step[0])
    assert run.energy["impact_loss"][first] == pytest.approx(0.75 * G * 0.1, rel=1e-9)
    assert run.energy["impact_loss"][-1] == pytest.approx(run.impacts.energy_lost.sum(), rel=1e-12)


def test_corners_of_a_fast_spin_touch_without_overlap() -> None:
    """Seen from an overlap, Newton's method may look before the touch; it comes back from the gap."""
    start = np.array([0.0, 0.4, 0.7, 0.3, 0.0, 3.0])
    run = simulate(toss_scene(start, 1000.0, restitution=1.0, seconds=3.0))
    energy = 0.5 * (run.v**2 @ np.array([1.0, 1.0, BOX.inertia])) + G * run.q[:, 1]
    touches = [heights(q, np.zeros(3), 0.0).min() for q in run.impacts.q]
    assert len(touches) > 8
    # A gap below 1e-12 (1 + |x| + |y|) counts as a touch; the fault left 2e-7.
    assert max(map(abs, touches)) < 3e-12
    assert np.ptp(energy) < 1e-11 * energy[0]  # a touch 1e-12 m off; the fault lost 8e-6


def test_the_certificate_judges_a_constant_mass_matrix_as_the_engine_has_it() -> None:
    """Turned, the inertia of this box rounds to another double, and 1 of 30 impacts would gain."""
    mass = 0.9608369981557852
    inertia = 0.0008835501300641513
    start = np.array([-0.18, 0.157, 0.746, 0.682, 0.589, 3.46])
    scene = toss_scene(start, 1000.0, restitution=1.0, seconds=4.0)
    changed = {"bodies.box.mass": mass, "bodies.box.inertia": inertia}
    run = simulate(scene.with_values(changed))
    found = certify(run)
    assert found.impacts > 10
    assert found.gains == 0


def test_impacts_say_when_and_where_they_happen() -> None:
    run = simulate(scene_from_text(bouncing()))
    fall = math.sqrt(2.0 * 0.1 / G)
    np.testing.assert_allclose(run.impacts.time, fall * np.arange(1, 8, 2)[: len(run.impacts.time)])
    np.testing.assert_allclose(run.impacts.q[:, 1], 0.1, atol=1e-12)
    np.testing.assert_allclose(run.impacts.v_minus[:, 1], -G * fall)
    assert certify(run).passed


def test_sticks_that_cross_edge_on_edge_do_not_pass() -> None:
    run = simulate(
        scene_from_text("""name: sticks
dimensions: 3
rate: 1000
duration: 0.05
bodies:
  - {name: stick, joint: free_flyer, mass: 0.1, inertia: [0.00133, 1.7e-06, 0.00133],
     shapes: [{kind: box, size: [0.01, 0.4, 0.01]}], position: [-0.0531, 0, 0, 0, 0, 0, 1],
     velocity: [20, 0, 0, 0, 0, 0]}
walls: [{name: bar, kind: box, size: [0.01, 0.01, 0.4], center: [0, 0, 0.1]}]
""")
    )
    assert run.q[:, 0].max() < -0.00999
    assert np.abs(run.v[-1, :3]).max() < 1e-9


@pytest.mark.parametrize("coupling", [FourChannel([1e5], [70.0]), NoCoupling()])
def test_the_tool_of_a_device_is_not_cut(coupling: Coupling) -> None:
    """Device and tool take an impulse in the same step; without a device the tool is cut."""
    scene = scene_from_text("""name: slider
rate: 1000
duration: 0.1
contact: {restitution: 0.5}
hand: {body: tool, force: [-1, 0, 0]}
device: {damping: [1]}
bodies:
  - {name: tool, joint: prismatic, axis: [1, 0], mass: 0.1, position: [0.011],
     velocity: [-0.3], shapes: [{kind: circle, radius: 0.01}]}
walls: [{name: wall, kind: half_plane, point: [0, 0], normal: [1, 0]}]
""")
    run = simulate(scene, ImpulseAugmented(), coupling)
    first = run.impacts.time[0] - run.impacts.step[0] * run.dt
    assert (first > 0.0) == isinstance(coupling, NoCoupling)


BOXES = scene_with(data_of(__file__, "boxes.yaml"))


@pytest.mark.parametrize("seed", [3, 17, 23, 33])
def test_an_impulse_is_recorded_where_it_struck(seed: int) -> None:
    """The bodies move on within the step; with the places of its last touch, `span` was 1e-3."""
    rng = np.random.default_rng(seed)
    thrown = {f"bodies.b{i}.velocity": rng.normal(0.0, 4.0, 3) for i in range(9)}
    certificate = certify(simulate(BOXES.with_values(thrown)))
    assert certificate.passed
    # rounding: 4e-12 at most in sixty throws; the tolerance of a certificate is 1e-9
    assert certificate.span < 1e-11


PAIR = scene_from_text("""name: pair
rate: 1000
duration: 0.001
bodies:
  - {name: still, joint: planar, mass: 1, inertia: 1e-3, shapes: [{kind: box, size: [0.06, 0.06]}]}
  - {name: flying, joint: planar, mass: 1, inertia: 1e-3, shapes: [{kind: box, size: [0.04, 0.04]}]}
""")


def spinning_pair(turns: tuple[float, float], start: list[float], v: float) -> Scene:
    """Two boxes whose corners turn by up to a radian in the one step of the scene."""
    values = {
        "bodies.still.velocity": [0.0, 0.0, turns[0]],
        "bodies.flying.velocity": [v, 0.0, turns[1]],
        "bodies.flying.position": start,
    }
    return PAIR.with_values(values)


def test_corners_that_strike_often_in_a_step_leave_room_for_the_next() -> None:
    """Contacts that have struck filled the table of contacts, and the run stopped."""
    run = simulate(spinning_pair((772.3008, 203.9584), [-0.02036525, 0.0522, 0.1073], 37.9305))
    assert len(run.impacts.step) > 2
    assert certify(run).passed
    assert np.ptp(run.energy["kinetic"]) < run.energy["kinetic"][0]


def test_corners_that_turn_past_each_other_are_not_taken_for_a_passage() -> None:
    """Seen from a body that turns, the way of the other is an arc: by Coriolis, too."""
    run = simulate(spinning_pair((329.25, 852.671), [-0.01064, 0.051, 0.558], 35.28))
    assert not len(run.impacts.step)
    assert not run.distrust
