"""Our coupled loop as a force law: the compiled engine, the fast model of CBuc, baselines."""

import numpy as np
import pytest

from iapb.errors import ArgumentError
from iapb.simulation import Simulation
from reference.worlds import find_world
from verification.port import BareDevice, check_force
from verification.port.baselines.coupler import UnilateralWall
from verification.port.baselines.passivity_control import PassivityControl
from verification.port.baselines.penalty import PenaltyWall
from verification.port.coupled import RADIUS, CoupledLoop, wall_scene
from verification.port.device import Port


def hand(seed, n=60):
    """A random walk of the hand from 1 mm before the wall."""
    walk = np.cumsum(np.random.default_rng(seed).normal(size=n)) * 5e-4
    return np.concatenate([[0.0], walk])[:, None] - 1e-3


class Moved:
    """A device that replays readings; it records the forces."""

    def __init__(self, q, v):
        self.q = q
        self.v = v
        self.forces = []

    def read(self):
        k = min(len(self.forces), len(self.q) - 1)
        from iapb.haptics.device import DeviceReading

        return DeviceReading(self.q[k], self.v[k])

    def apply(self, force):
        self.forces.append(np.array(force))


@pytest.mark.parametrize("world", ["PB", "IAPB", "CBuc"])
def test_following_a_hand_gives_the_bits_of_a_device_that_moves_alike_again_and_again(world):
    scene = wall_scene(world, 1000.0, 50.0)
    device = BareDevice(512.0)
    q, v = device.readings(hand(0) - RADIUS)
    moved = Moved(q, v)
    chosen = find_world(world)
    simulation = Simulation(scene, chosen.law, chosen.coupling_in(scene), device=moved)
    for _ in q:
        simulation.step()
    loop = CoupledLoop(scene, world)
    for _ in range(2):
        assert np.array_equal(loop.follow(q, v), moved.forces)


@pytest.mark.parametrize("damping", [0.0, 50.0])
def test_the_fast_model_of_cbuc_gives_the_forces_of_the_engine(damping):
    loop = CoupledLoop(wall_scene("CBuc", 1000.0, damping), "CBuc")
    device = BareDevice(512.0)
    for seed in range(3):
        x = hand(seed)
        ours = Port(loop, device, 1).forces(x - RADIUS)
        fast = Port(UnilateralWall(1000.0, damping), device, 1).forces(x)
        # rounding: the engine's positions are those of the disc's centre, 10 mm away
        assert np.allclose(ours, fast, atol=1e-10)


def test_a_device_of_another_rate_than_the_scene_is_refused_and_a_law_s_own_rate_is_its_own():
    loop = CoupledLoop(wall_scene("PB", 1000.0, 50.0), "PB")
    with pytest.raises(ArgumentError, match="rate"):
        check_force(loop, BareDevice(1000.0), start=loop.start(1))
    wall = PenaltyWall(1000.0)
    object.__setattr__(wall, "rate", 0.0)
    assert check_force(wall, BareDevice(damping=1.0), effort=0.05).passed


def test_saturated_forces_stay_within_the_limit():
    scene = wall_scene("IAPB", 1000.0, 50.0, limit=5.0)
    loop = CoupledLoop(scene, "IAPB", "saturate")
    x = hand(1)
    forces = Port(loop, BareDevice(512.0), 1).forces(x - RADIUS)
    assert np.abs(forces).max() == 5.0


def test_passivity_control_makes_a_passive_wall_active():
    device = BareDevice(damping=1.02)
    options = {"laws": ["energy"], "effort": 0.3}
    assert check_force(PenaltyWall(2000.0), device, **options).passed
    controlled = check_force(PassivityControl(PenaltyWall(2000.0)), device, **options)
    assert not controlled.passed and controlled.damping_needed > 10.0
