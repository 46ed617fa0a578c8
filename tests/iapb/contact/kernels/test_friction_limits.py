"""Limits that move with the friction they allow: what is said to be settled obeys Coulomb's law."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb import resolve_frictional_impact, resolve_impact


def drawn(seed: int) -> tuple[Any, ...]:
    """M, J, T, v, e, μ up to 1: large enough for limits that swing."""
    rng = np.random.default_rng(seed)
    d, c, m = int(rng.integers(2, 8)), int(rng.integers(1, 5)), int(rng.integers(1, 3))
    root = rng.normal(size=(d, d))
    rows, tangents, v = rng.normal(size=(c, d)), rng.normal(size=(c, m, d)), rng.normal(size=d)
    e, mu = float(rng.choice([0.0, 0.4, 1.0])), rng.uniform(0.0, 1.0, c)
    return root @ root.T + 0.1 * np.eye(d), rows, tangents, v, e, mu


def breach_of_coulomb(T: Any, mu: Any, found: Any) -> float:
    """Largest speed by which w_i = T_i v⁺ is not what friction leaves: 0 within the cone, against p_t on it [m/s]."""
    breach = 0.0
    for i, own in enumerate(found.tangential_impulses):
        w, limit, length = T[i] @ found.velocity, mu[i] * max(found.impulses[i], 0.0), float(np.linalg.norm(own))
        if length < limit * (1.0 - 1e-7):
            breach = max(breach, float(np.linalg.norm(w)))
        elif length > 0.0:
            breach = max(breach, float(np.linalg.norm(w + own / length * np.linalg.norm(w))))
    return breach


def test_where_it_is_complete_every_contact_sticks_or_slides_against_its_friction() -> None:
    complete = 0
    for seed in range(400):
        M, J, T, v, e, mu = drawn(seed)
        if len(J) * (1 + T.shape[1]) > len(v):
            continue  # normals that hold every motion leave friction nothing to stop
        found = resolve_frictional_impact(M, J, T, v, e, mu)
        pushing = resolve_impact(M, J, v, e).impulses.min() > 0.0  # what pulls carries no friction, by definition
        if pushing and found.status == "complete" and found.friction_share == 1.0:
            complete += 1
            # MET is 1e-10 of the speed that a slip is summed from; sliding directions lose digits with the slip.
            assert breach_of_coulomb(T, mu, found) <= 1e-7 * np.abs(T).max() * np.linalg.norm(v) * len(v)
    assert complete > 10


@pytest.mark.parametrize("seed", [12, 41, 45, 104, 133, 172, 233, 354, 369])
def test_limits_that_swing_at_first_settle(seed: int) -> None:
    """Without damping, or with another one than half and a fifth, these do not within the rounds."""
    M, J, T, v, e, mu = drawn(seed)
    found = resolve_frictional_impact(M, J, T, v, e, mu)
    assert found.status == "complete"
