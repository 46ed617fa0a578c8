"""What the structure says about M and B holds in numbers; merging what is fixed together changes
neither."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from reference.random_mechanisms import random_mechanism, random_state

INERTIA = np.diag([0.1, 0.2, 0.3])
BALL = 0.2 * np.eye(3)


def body(kind, parent=None, center=(0.0, 0.0, 0.0), inertia=INERTIA, name="body", axis=(0, 0, 1)):
    return Body(name, parent, Joint(kind, axis), mass=2.0, center_of_mass=center, inertia=inertia)


SLIDE = body("prismatic", name="slide", axis=(1, 0, 0))
CASES = [  # bodies, M constant, velocity terms
    ([body("planar", center=(0, 0, 0.3))], True, False),  # on the axis
    ([body("planar", center=(0.1, 0, 0))], False, True),
    ([body("revolute"), body("revolute", "body", name="second", axis=(1, 0, 0))], False, True),
    ([SLIDE, body("revolute", "slide", (0.1, 0, 0))], False, True),
    ([SLIDE, body("spherical", "slide", inertia=BALL)], True, False),
    ([body("spherical", center=(0.1, 0, 0))], True, True),
    ([body("free_flyer", inertia=BALL)], True, True),
    ([SLIDE, body("free_flyer", "slide")], False, True),
    ([body("fixed")], True, False),
]


def spread(mechanism, seed=0):
    """Largest change of M, and largest B, over random states."""
    rng = np.random.default_rng(seed)
    states = [random_state(rng, mechanism) for _ in range(6)]
    first = mechanism.mass_matrix(states[0][0])
    change = max(np.abs(mechanism.mass_matrix(q) - first).max(initial=0.0) for q, _ in states)
    return change, max(np.abs(mechanism.bias(q, v)).max(initial=0.0) for q, v in states)


@pytest.mark.parametrize(("bodies", "constant", "terms"), CASES)
def test_known_structures(bodies, constant, terms):
    mechanism = Mechanism(bodies)
    assert (mechanism.has_constant_mass_matrix, mechanism.has_velocity_terms) == (constant, terms)
    change, force = spread(mechanism)
    assert (change <= 1e-12) == constant
    assert (force <= 1e-12) == (not terms)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3))
def test_a_no_is_always_true(seed, joints):
    mechanism = random_mechanism(np.random.default_rng(seed), joints, tuple(KINDS))
    change, force = spread(mechanism, seed)
    size = max(np.abs(mechanism.mass_matrix(mechanism.neutral())).max(initial=0.0), 1e-300)
    if mechanism.has_constant_mass_matrix:
        assert change <= 1e-10 * size
    if not mechanism.has_velocity_terms:
        assert force <= 1e-10 * size
