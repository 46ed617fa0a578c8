"""The energy at the hand's port, what a law reads, and the laws that a law may be."""

import numpy as np
import pytest

from iapb.errors import ArgumentError
from verification.laws.resolver import ResolverFault
from verification.port.device import BareDevice, Motion, Port, sums_of


def test_a_spring_gives_half_of_k_dx_squared_in_each_period():
    """Σ −K x Δx = ½ K Σ Δx² − ½ K x_n², for any motion from 0."""
    x = np.random.default_rng(0).normal(size=(50, 1))
    x[0] = 0.0
    sums = sums_of(x, -300.0 * x, 1e-3)
    change = np.diff(x[:, 0])
    expected = 150.0 * np.cumsum(change**2) - 150.0 * x[1:, 0] ** 2
    assert np.allclose(sums.work, expected, rtol=1e-12, atol=1e-10)  # rounding of 50 terms
    assert np.allclose(sums.damped, np.cumsum(change**2) / 1e-3)
    assert np.allclose(sums.rubbed, np.cumsum(np.abs(change)))
    drawn = sums.drawn(0.15, 0.01)
    assert np.allclose(drawn, sums.work - 0.15 * sums.damped - 0.01 * sums.rubbed, atol=1e-9)


def test_readings_are_rounded_late_and_differenced():
    device = BareDevice(rate=100.0, resolution=0.1, delay=1)
    x, v = device.readings(np.array([[0.0], [0.14], [0.26], [0.26]]))
    assert np.allclose(x[:, 0], [0.0, 0.0, 0.1, 0.3])
    assert np.allclose(v[:, 0], [0.0, 0.0, 10.0, 20.0])


def test_no_reading_knows_the_future():
    rng = np.random.default_rng(1)
    device = BareDevice(resolution=1e-3, delay=2)
    at = rng.normal(size=(20, 2))
    changed = at.copy()
    changed[10:] += 1.0
    for one, other in zip(device.readings(at), device.readings(changed), strict=True):
        assert np.array_equal(one[:12], other[:12])


class Counter:
    """Counts its samples since the reset; knows the period."""

    def reset(self, dt):
        self.dt = dt
        self.count = 0

    def step(self, x, v):
        self.count += 1
        return self.count * self.dt


@pytest.mark.parametrize("law", [Counter, Counter()])
def test_each_motion_begins_with_a_fresh_law_that_knows_the_period(law):
    port = Port(law, BareDevice(rate=10.0), 1)
    for _ in range(2):
        assert np.allclose(port.forces(np.zeros((3, 1)))[:, 0], [0.1, 0.2, 0.3])
    assert port.calls == 6


def test_a_law_may_return_the_same_array_again_and_its_changes_are_counted():
    held = np.zeros(2)

    def law(x, v):
        held[:] = x
        x += 1.0
        return held

    port = Port(law, BareDevice(), 2)
    at = np.arange(6.0).reshape(3, 2)
    assert np.array_equal(port.forces(at), at) and port.changed == 1


@pytest.mark.parametrize("answer", [np.nan, np.inf, None, [1.0, 2.0]])
def test_an_unusable_force_is_a_fault_of_the_law(answer):
    with pytest.raises(ResolverFault):
        Port(lambda x, v: answer, BareDevice(), 1).forces(np.zeros((3, 1)))


def test_a_motion_is_lead_and_rounds_and_the_return():
    motion = Motion(np.zeros(1), np.array([[1.0]]), np.array([[2.0], [3.0]]), 2)
    assert motion.positions.ravel().tolist() == [0, 1, 2, 3, 2, 3, 2]


@pytest.mark.parametrize(
    "wrong", [{"rate": 0.0}, {"reach": -1.0}, {"damping": -1.0}, {"delay": 0.5}]
)
def test_an_impossible_device_is_refused(wrong):
    with pytest.raises(ArgumentError):
        BareDevice(**wrong)
