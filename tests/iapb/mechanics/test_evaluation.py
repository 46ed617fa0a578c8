"""Many states in one call, and what is refused at the border of the compiled evaluations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError
from iapb.mechanics.mechanism import Mechanism
from reference.random_mechanisms import random_mechanism, random_state

seeds = st.integers(0, 2**32 - 1)


def some_states(seed: int, count: int) -> tuple[Mechanism, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    mechanism = random_mechanism(rng, 5)
    states = [random_state(rng, mechanism) for _ in range(count)]
    qs, vs = (np.array(rows).reshape(count, -1) for rows in zip(*states, strict=True))
    return mechanism, qs, vs


@given(seeds, st.integers(1, 5))
def test_many_states_give_bit_for_bit_what_each_gives_alone(seed: int, count: int) -> None:
    mechanism, qs, vs = some_states(seed, count)
    np.testing.assert_array_equal(mechanism.mass_matrices(qs), [mechanism.mass_matrix(q) for q in qs])
    alone = [mechanism.bias(q, v) for q, v in zip(qs, vs, strict=True)]
    np.testing.assert_array_equal(mechanism.biases(qs, vs), alone)


def test_any_layout_and_type_of_numbers_is_read_right() -> None:
    mechanism, qs, vs = some_states(3, 4)
    for layout in (np.asfortranarray, lambda rows: np.repeat(rows, 2, axis=1)[:, ::2], list):
        np.testing.assert_array_equal(mechanism.mass_matrices(layout(qs)), mechanism.mass_matrices(qs))
        np.testing.assert_array_equal(mechanism.biases(layout(qs), layout(vs)), mechanism.biases(qs, vs))
    columns = np.asfortranarray(qs)
    np.testing.assert_array_equal(mechanism.mass_matrix(columns[1]), mechanism.mass_matrix(qs[1]))
    whole = np.zeros(mechanism.nv, dtype=np.int64)
    np.testing.assert_array_equal(mechanism.bias(qs[0], whole), mechanism.bias(qs[0], 0.0 * vs[0]))


def test_no_states_give_no_matrices() -> None:
    mechanism, qs, vs = some_states(4, 1)
    d = mechanism.nv
    assert mechanism.mass_matrices(qs[:0]).shape == (0, d, d)
    assert mechanism.biases(qs[:0], vs[:0]).shape == (0, d)


def test_the_row_at_fault_is_named() -> None:
    mechanism = random_mechanism(np.random.default_rng(1), 3, ("spherical",))
    qs, vs = np.tile(mechanism.neutral(), (4, 1)), np.zeros((4, mechanism.nv))
    qs[2, 3] = 1.1
    with pytest.raises(ArgumentError, match=r"qs\[2\] of body 'body 0.0'"):
        mechanism.mass_matrices(qs)
    qs[2, 3], vs[1, 0] = 1.0, np.nan
    with pytest.raises(ArgumentError, match=r"vs\[1\]"):
        mechanism.biases(qs, vs)
    with pytest.raises(ArgumentError, match="as many rows as qs"):
        mechanism.biases(qs, vs[:2])
    with pytest.raises(ArgumentError, match="qs"):
        mechanism.mass_matrices(qs[:, 1:])
    with pytest.raises(ArgumentError, match="qs"):
        mechanism.mass_matrices([["a"] * mechanism.nq])
