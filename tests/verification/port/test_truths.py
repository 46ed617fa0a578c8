"""What the search finds, relative to closed forms that it never sees."""

from dataclasses import replace

import numpy as np
import pytest

from tests.verification.port import truths
from tests.verification.port.truths import JUMP, B, K, Linear, T
from verification.port import BareDevice, check_force
from verification.port.baselines.energy_bounding import EnergyBounding
from verification.port.baselines.implicit_wall import ImplicitWall
from verification.port.baselines.impulses import ImpulseWall
from verification.port.baselines.midpoint_wall import MidpointWall
from verification.port.baselines.penalty import PenaltyWall

CLOSE = 0.99  # the bar of the search: at least this share of what is needed
EXACT = 1.0005  # an actual motion never needs more; some truths are given to four digits
IMPLICIT = 1.0 + (B + K * T) * T / 0.1
HESSIAN = np.array([[1500.0, 400.0], [400.0, 900.0]])
CURL = np.array([[K, 300.0], [-300.0, K]])
WALL = Linear(K, B)
WITHOUT_FORCE = [(-1.0, 0.0), (-1.0, np.inf), (1.0, -np.inf), (1.0, -np.inf), (-1.0, -np.inf)]


def clamped(x, v):
    return min(max(WALL.step(x, v), -5.0), 5.0)


def jump(x, v):
    return -K * x - (JUMP if x > 0.009 else 0.0)


def dry_friction(x, v):
    return -JUMP * np.sign(v)


WALL.reset(T)
# law, periods of delay, least damping without friction
DAMPINGS = {
    "spring and damper": (WALL, 0, K * T / 2 + B),
    "negative damper": (Linear(K, -B), 0, K * T / 2 + B),
    "one-sided": (PenaltyWall(K, B), 0, K * T / 2 + B),
    "clamped": (clamped, 0, K * T / 2 + B),
    "two periods late": (Linear(), 2, 2.5 * K * T),
    "filter": (Linear(K, B, 3e-3), 0, K * T / 2 + B * T / (T + 6e-3)),
    "every second period": (truths.Renewed, 0, K * T),
    "potential": (Linear(HESSIAN), 0, T / 2 * np.linalg.eigvalsh(HESSIAN)[-1]),
    "impulse": (ImpulseWall(PenaltyWall(0.0), 2.0, 0.5), 0, 1.5 * 2.0 / (2.0 * T)),
    "energy bounding": (EnergyBounding(PenaltyWall(K), 0.5), 0, 0.5),
    "implicit": (ImplicitWall(K, B, 0.1), 0, (K * T / 2 + B + K * T) / IMPLICIT),
    "midpoint": (MidpointWall(K), 0, K * T),
}
FRICTIONS = {  # law, resolution, damping, least friction
    "spring": (Linear(), 5e-5, K * T / 2, K * 5e-5 / 2),
    "damper": (WALL, 5e-5, K * T / 2 + B, K * 5e-5 / 2 + B * 5e-5 / T),
    "jump": (jump, 0.0, K * T / 2, JUMP / 2),
    "dry friction": (dry_friction, 0.0, 0.5, JUMP),
}


def energy(law, device, **options):
    plane = np.ndim(getattr(law, "stiffness", 0.0))
    return check_force(law, device, start=[0.0, 0.0] if plane else 0.0, laws=["energy"], **options)


@pytest.mark.parametrize("wall", [PenaltyWall(K, B), ImpulseWall(PenaltyWall(K, B))])
def test_a_wall_pushes_with_nothing_outside_and_never_pulls_at_any_velocity(wall):
    if isinstance(wall, ImpulseWall):
        wall.reset(T)
    assert [wall.step(*sample) for sample in WITHOUT_FORCE] == [0.0] * len(WITHOUT_FORCE)
    assert wall.step(1.0, np.inf) == -np.inf


@pytest.mark.parametrize("name", DAMPINGS)
def test_the_damping_that_is_found_is_the_damping_that_is_needed(name):
    law, delay, need = DAMPINGS[name]
    report = energy(law, BareDevice(delay=delay))
    assert CLOSE * need <= report.damping_needed <= EXACT * need


@pytest.mark.parametrize("name", FRICTIONS)
def test_the_friction_that_is_found_is_the_friction_that_is_needed(name):
    law, resolution, damping, need = FRICTIONS[name]
    report = energy(law, BareDevice(damping=damping, resolution=resolution))
    assert CLOSE * need <= report.friction_needed <= EXACT * need
    assert report.damping_needed == np.inf  # without friction no damping is enough


@pytest.mark.thorough
@pytest.mark.parametrize("p", [4, 12])
def test_a_curl_needs_more_damping_the_slower_its_loop(p):
    """KT/2 + (cT/2) cot(π/p) for p samples, so no damping is enough."""
    need = K * T / 2 + CURL[0, 1] * T / 2 / np.tan(np.pi / p)
    assert energy(Linear(CURL), BareDevice()).damping_needed == np.inf
    assert not energy(Linear(CURL), BareDevice(damping=1.05 * need)).passed


def judged(law, device, k, **options):
    """The ratio of what is found to what is needed; at 1.001 of it there must be no alarm."""
    need = max(law.need(device), 0.0)
    found = energy(law, device, **options).damping_needed
    assert energy(law, replace(device, damping=1.001 * need), seed=k, **options).passed
    return found / need if need else 1.0 + found


@pytest.mark.thorough
@pytest.mark.parametrize("k", range(60))
def test_random_linear_walls(k):
    assert CLOSE <= judged(*truths.random_wall(k), k) <= EXACT


@pytest.mark.thorough
@pytest.mark.parametrize("k", range(40))
def test_random_force_tables(k):
    law, device = truths.random_table(k)
    assert CLOSE <= judged(law, device, k, stored=law.stored) <= EXACT


@pytest.mark.thorough
@pytest.mark.parametrize("k", range(30))
def test_random_rounded_walls(k):
    law, device = truths.random_rounded(k)
    for share, passes in ((1.02, True), (0.9, False)):
        own = replace(device, damping=share * device.damping, friction=share * device.friction)
        assert energy(law, own, seed=k).passed is passes
