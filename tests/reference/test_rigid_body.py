"""The engine's mechanics against Pinocchio: random trees, real robots, impacts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iapb import resolve_impact
from iapb.errors import ArgumentError
from iapb.mechanics.joints import KINDS
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from reference import rigid_body
from reference.random_mechanisms import random_mechanism, random_state
from verification.mechanics.engine_differences import compare

AGREEMENT = 1e-11  # relative to the largest entry; two algorithms of 30 links, each exact to some 1e-14
ROBOTS = sorted((Path(__file__).parents[3] / "shared" / "robots").glob("*.urdf"))
MOVING = tuple(kind for kind in KINDS if kind != "fixed")
seeds = st.integers(0, 2**32 - 1)


def agree(mechanism: Mechanism, model: Any, rng: np.random.Generator, states: int = 1) -> None:
    for _ in range(states):
        differences = compare(mechanism, model, *random_state(rng, mechanism))
        assert max(differences.values()) <= AGREEMENT, differences


@settings(max_examples=60)
@given(seeds, st.integers(1, 30), st.integers(1, 3))
def test_random_trees_agree(seed: int, joints: int, trees: int) -> None:
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, joints, trees=trees)
    if mechanism.nv:
        agree(mechanism, rigid_body.model_of(mechanism), rng)


@pytest.mark.parametrize("kind", MOVING)
def test_each_joint_kind_agrees_alone_and_in_a_chain(kind: str) -> None:
    rng = np.random.default_rng(5)
    for joints in (1, 3):
        mechanism = random_mechanism(rng, joints, (kind,))
        agree(mechanism, rigid_body.model_of(mechanism), rng, 10)


@settings(max_examples=40)
@given(seeds, st.floats(1e-3, 3.0))
def test_motion_on_the_manifold_agrees(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 6, MOVING)
    model, (q, v) = rigid_body.model_of(mechanism), random_state(rng, mechanism)
    v *= size / np.abs(v).max()
    theirs = model.integrate(q, v, 1.0)
    assert np.abs(mechanism.difference(mechanism.integrate(q, v, 1.0), theirs)).max() <= 1e-7


def test_the_comparison_sees_a_wrong_inertia() -> None:
    mechanism = random_mechanism(np.random.default_rng(1), 5, ("revolute",))
    heavier = replace(mechanism.bodies[3], mass=mechanism.bodies[3].mass * (1.0 + 1e-6))
    wrong = Mechanism([*mechanism.bodies[:3], heavier, mechanism.bodies[4]])
    state = random_state(np.random.default_rng(2), mechanism)
    differences = compare(wrong, rigid_body.model_of(mechanism), *state)
    assert differences["mass_matrix"] > AGREEMENT and differences["bias"] > AGREEMENT
    assert differences["frame_jacobian"] <= AGREEMENT  # where bodies are does not depend on their mass


@pytest.mark.skipif(not ROBOTS, reason="no robots beside the checkout (../shared/robots/*.urdf)")
@pytest.mark.parametrize("floating_base", [False, True], ids=["fixed base", "floating base"])
@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_robots_read_twice_agree(path: Path, floating_base: bool) -> None:
    mechanism = Mechanism.from_urdf(path, floating_base)
    model = rigid_body.model_from_urdf(path, floating_base)
    assert (mechanism.nq, mechanism.nv) == (model.nq, model.nv)
    agree(mechanism, model, np.random.default_rng(3), 100 if mechanism.nv < 20 else 20)


def test_a_model_in_another_order_and_an_unknown_body_are_refused() -> None:
    root, left, right, hand = (Body(name, parent, Joint("revolute"), mass=1.0, inertia=np.eye(3)) for name, parent in
                               (("root", None), ("left", "root"), ("right", "root"), ("hand", "left")))  # fmt: skip
    model = rigid_body.model_of(Mechanism([root, left, hand, right]))
    with pytest.raises(ArgumentError, match="depth-first"):
        rigid_body.model_of(Mechanism([root, left, right, hand]))
    with pytest.raises(ArgumentError, match="name of a body"):
        model.placement(np.zeros(4), "foot")


@settings(max_examples=100)
@given(seeds, st.integers(1, 12), st.floats(-1.0, 1.0), st.floats(0.0, 4.0))
def test_impulse_dynamics_agrees_on_independent_rows(seed: int, d: int, restitution: float, decades: float) -> None:
    rng = np.random.default_rng(seed)
    rows = int(rng.integers(1, d + 1))
    # A = J L^-T with singular values over the given decades: J = A L^T
    lower = np.tril(rng.normal(size=(d, d)), -1) * 0.3 + np.diag(rng.uniform(0.5, 2.0, d))
    left, right = (np.linalg.qr(rng.normal(size=(n, n)))[0] for n in (rows, d))
    a = left @ np.diag(np.logspace(0.0, -decades, rows)) @ right[:rows]
    mass, jacobian, v = lower @ lower.T, a @ lower.T, rng.normal(size=d)
    theirs = rigid_body.impulse_dynamics(mass, jacobian, v, restitution)
    ours = resolve_impact(mass, jacobian, v, restitution).velocity
    kappa = np.linalg.cond(np.linalg.solve(lower, jacobian.T))
    bound = 1e-12 if kappa <= 10.0 else 100.0 * np.finfo(float).eps * kappa**2
    assert np.abs(ours - theirs).max() <= bound * np.abs(v).max()
