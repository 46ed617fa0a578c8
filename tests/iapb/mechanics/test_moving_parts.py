"""Merging what is fixed together changes neither M nor B."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iapb.compiled import block
from iapb.mechanics import kernels
from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.mechanics.structure import moving_parts
from reference.random_mechanisms import random_mechanism, random_state

AGREEMENT = 1e-12  # of the largest entry: the same sums in another order, over ten bodies
KINDS_OFTEN_FIXED = (*KINDS, "fixed", "fixed", "fixed")


def unmerged(mechanism: Mechanism, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M and B from all bodies, moving or not."""
    mass, bias = np.zeros((mechanism.nv, mechanism.nv)), np.zeros(mechanism.nv)
    arrays, scratch = block(mechanism.arrays), block(mechanism.workspace())
    kernels.forward_kinematics(arrays, q, scratch)
    kernels.mass_matrix(arrays, scratch, mass)
    kernels.bias(arrays, scratch, v, bias)
    return mass, bias


@given(st.integers(0, 2**32 - 1), st.integers(1, 10), st.integers(1, 3))
def test_mass_matrix_and_bias_are_those_of_all_bodies(seed: int, joints: int, trees: int) -> None:
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, joints, KINDS_OFTEN_FIXED, trees)
    q, v = random_state(rng, mechanism)
    mass, bias = unmerged(mechanism, q, v)
    speed = np.abs(v).max(initial=0.0) ** 2
    scale = np.abs(mass).max(initial=0.0)
    assert np.abs(mechanism.mass_matrix(q) - mass).max(initial=0.0) <= AGREEMENT * scale
    assert np.abs(mechanism.bias(q, v) - bias).max(initial=0.0) <= AGREEMENT * max(
        np.abs(bias).max(initial=0.0), scale * speed
    )


def test_only_bodies_that_move_are_left() -> None:
    base = Body("base", None, Joint("fixed"), mass=5.0)
    arm = Body("arm", "base", Joint("revolute"), (np.eye(3), (1.0, 0, 0)), 1.0, (0.5, 0, 0))
    flange = Body("flange", "arm", Joint("fixed"), (np.eye(3), (1.0, 0, 0)), 3.0, (0.5, 0, 0))
    tool = Body("tool", "flange", Joint("prismatic", (1, 0, 0)), (np.eye(3), (0.5, 0, 0)), 1.0)
    parts = moving_parts(Mechanism([base, arm, flange, tool]).arrays)
    assert list(parts.parent) == [-1, 0] and list(parts.mass) == [4.0, 1.0]
    np.testing.assert_allclose(parts.center_of_mass[0], [(0.5 + 3 * 1.5) / 4, 0, 0], rtol=1e-15)
    np.testing.assert_allclose(parts.placement_position, [[1.0, 0, 0], [1.5, 0, 0]], rtol=1e-15)
    np.testing.assert_allclose(parts.inertia[0][1, 1], 0.75, rtol=1e-15)  # 1 * 3 / (1 + 3) kg at 1 m


def test_a_mechanism_that_cannot_move_has_an_empty_mass_matrix() -> None:
    ground = Mechanism([Body("ground", None, Joint("fixed"), mass=1.0)])
    assert ground.mass_matrix([]).shape == (0, 0) and ground.bias([], []).shape == (0,)
