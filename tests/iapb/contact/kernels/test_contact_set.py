"""Section III in space against its statement in numpy: clusters, what is new, groups and states, and their limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iapb.compiled import block
from iapb.contact.geometry import make_contact_buffer
from iapb.contact.kernels.contact_set import (
    TOUCHING,
    classify,
    cluster,
    group_of_contact,
    mark_new,
    moving_tree,
    same_surface,
    squared_distance,
)
from iapb.run import COLLIDING, FREE, RESTING

GEOMETRY = ("shape_a", "shape_b", "body_a", "body_b", "feature", "point", "normal", "gap")
IDENTITY = ("shape_a", "shape_b", "feature")
COSINE = 0.85


def random_contacts(rng: np.random.Generator, count: int, bodies: int = 2) -> Any:
    """Contacts near each other, of few bodies, with normals near each other or nearly opposed."""
    buffer: Any = block(make_contact_buffer(max(count, 1)))
    buffer.point[:] = rng.uniform(-0.1, 0.1, buffer.point.shape)
    normals = rng.choice([-1.0, 1.0], (len(buffer.gap), 1)) * [0.6, -0.64, 0.48] + 0.4 * rng.normal(size=(1, 3))
    normals = normals + 0.25 * rng.normal(size=normals.shape)
    buffer.normal[:] = normals / np.linalg.norm(normals, axis=1)[:, None]
    buffer.gap[:] = rng.uniform(-1e-3, 2e-4, len(buffer.gap))
    buffer.body_a[:] = rng.integers(0, bodies, len(buffer.gap))
    buffer.body_b[:] = rng.integers(-1, bodies, len(buffer.gap))
    for name in ("shape_a", "shape_b", "feature"):
        getattr(buffer, name)[:] = rng.integers(0, 3, len(buffer.gap))
    buffer.normal_velocity[:] = rng.uniform(-2.0, 2.0, len(buffer.gap))
    return buffer


def one_surface(first: Any, i: int, second: Any, j: int) -> bool:
    aligned = float(first.normal[i] @ second.normal[j])
    pair, other = (first.body_a[i], first.body_b[i]), (second.body_a[j], second.body_b[j])
    return bool((pair == other and aligned >= COSINE) or (pair == other[::-1] and pair != other and -aligned >= COSINE))


def distance(first: Any, i: int, second: Any, j: int) -> float:
    return float(np.linalg.norm(first.point[i] - second.point[j]))


@pytest.mark.parametrize("seed", range(12))
def test_a_cluster_keeps_the_deepest_and_whole_rows_close_ranks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, reach = int(rng.integers(1, 14)), 0.12
    contacts = random_contacts(rng, count)
    before = {name: getattr(contacts, name).copy() for name in GEOMETRY}
    kept: list[int] = []
    for i in np.argsort(contacts.gap, kind="stable"):
        if not any(one_surface(contacts, k, contacts, i) and distance(contacts, k, contacts, i) < reach for k in kept):
            kept.append(int(i))
    kept.sort()
    assert cluster(contacts, count, reach) == len(kept)
    for name in GEOMETRY:
        np.testing.assert_array_equal(getattr(contacts, name)[: len(kept)], before[name][kept], err_msg=name)


@pytest.mark.parametrize("reach", [0.0, 0.05, 0.15])
def test_a_contact_is_new_unless_one_of_the_step_before_vouches_for_it(reach: float) -> None:
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(20):
        count, count_before = (int(n) for n in rng.integers(1, 9, 2))
        now, before = random_contacts(rng, count), random_contacts(rng, count_before)
        mark_new(now, count, before, count_before, reach)
        for i in range(count):
            old = False
            for j in range(count_before):
                touched = before.gap[j] < -TOUCHING
                same = all(getattr(now, name)[i] == getattr(before, name)[j] for name in IDENTITY)
                near = reach > 0.0 and one_surface(now, i, before, j) and distance(now, i, before, j) <= reach
                stop = now.shape_a[i] == now.shape_b[i] or before.shape_a[j] == before.shape_b[j]
                old = old or (touched and (same or (near and not stop)))
            assert bool(now.is_new[i]) == (not old)
            seen.add(old)
    assert seen == {False, True}


@pytest.mark.parametrize(("gap", "new"), [(0.0, True), (-1e-17, True), (-1e-12, True), (-2e-12, False), (1e-9, True)])
def test_a_contact_is_new_until_it_has_overlapped(gap: float, new: bool) -> None:
    now, before = pair_of_contacts(), pair_of_contacts()
    before.gap[:] = gap
    mark_new(now, 1, before, 1, 0.0)
    assert bool(now.is_new[0]) is new


def test_limits_of_distance_and_angle() -> None:
    """Closer than the distance is one cluster, at it none; at the distance a contact is old; at the cosine aligned."""
    for count, reach in ((2, 5.0), (1, np.nextafter(5.0, 6.0))):
        assert cluster(pair_of_contacts(), 2, reach) == count
    before, after = pair_of_contacts(), pair_of_contacts()
    after.feature[:] = 7
    mark_new(after, 2, before, 1, 5.0)
    assert not after.is_new[:2].any()
    mark_new(after, 2, before, 1, np.nextafter(5.0, 0.0))
    assert after.is_new[:2].tolist() == [False, True]
    assert squared_distance(before, 0, before, 1) == 25.0
    before.normal[1] = (0.0, 0.6, 0.8)
    before.normal[0] = (0.0, 0.0, 1.0)
    assert same_surface(before, 0, before, 1, 0.8) and not same_surface(before, 0, before, 1, np.nextafter(0.8, 1.0))
    before.body_a[1], before.body_b[1], before.normal[1] = -1, 0, (0.0, -0.6, -0.8)
    assert same_surface(before, 0, before, 1, 0.8) and not same_surface(before, 0, before, 1, np.nextafter(0.8, 1.0))
    before.body_b[1] = 1
    assert not same_surface(before, 0, before, 1, 0.8)


def pair_of_contacts() -> Any:
    """Of body 0 and the world, 5 m from each other, 3 along x and 4 along z."""
    contacts: Any = block(make_contact_buffer(2))
    contacts.body_b[:], contacts.normal[:], contacts.gap[:] = -1, (0.0, 0.0, 1.0), (-2.0, -1.0)
    contacts.point[1], contacts.shape_b[:] = (3.0, 0.0, 4.0), 1
    contacts.feature[:] = (0, 1)
    return contacts


TREES = np.array([0, 0, 1, 2, 3, 3, 4])  # of seven bodies; tree 2 cannot move
START, STOP = np.array([0, 6, 9, 9, 12]), np.array([6, 9, 9, 12, 15])


def tree_of(body: int) -> int:
    return -1 if body < 0 or TREES[body] == 2 else int(TREES[body])


def groups_of(contacts: Any, count: int) -> list[int]:
    """The smallest tree that touching contacts connect each tree to."""
    group = list(range(5))
    for _ in range(5):
        for i in range(count):
            a, b = tree_of(int(contacts.body_a[i])), tree_of(int(contacts.body_b[i]))
            if contacts.gap[i] <= 0.0 and a >= 0 and b >= 0:
                group[a] = group[b] = min(group[a], group[b])
    return group


@pytest.mark.parametrize("seed", range(40))
def test_states_of_groups_are_what_section_iii_says(seed: int) -> None:
    """Colliding: a touching contact approaches that is new, or while the group spreads; resting: one touches."""
    rng, approach = np.random.default_rng(seed), 1.0
    count = int(rng.integers(0, 7))
    contacts = random_contacts(rng, count, 7)
    contacts.is_new[:] = rng.integers(0, 2, len(contacts.gap)) > 0
    if count > 1:
        contacts.normal_velocity[0], contacts.gap[1] = -approach, 0.0  # the limits themselves
    spreading = rng.integers(0, 4, 5) == 0
    group, wanted = groups_of(contacts, count), np.full(5, FREE)
    spreads = {g: any(spreading[t] for t in range(5) if group[t] == g) for g in group}
    touching, collides = contacts.gap[:count] <= 0.0, np.zeros(count, bool)
    of_contact = [max(tree_of(int(a)), -1) if tree_of(int(a)) >= 0 else tree_of(int(b))
                  for a, b in zip(contacts.body_a[:count], contacts.body_b[:count], strict=True)]
    approaching = touching & (contacts.normal_velocity[:count] < -approach)
    for t in range(5):
        members = [i for i in range(count) if of_contact[i] >= 0 and group[of_contact[i]] == group[t]]
        if any(approaching[i] and (contacts.is_new[i] or spreads[group[t]]) for i in members):
            wanted[t] = COLLIDING
            collides[members] = approaching[members]
        elif any(touching[i] for i in members):
            wanted[t] = RESTING
    state, found = np.zeros(5, np.int8), np.zeros(5, np.int64)
    classify(contacts, count, TREES, START, STOP, approach, spreading, found, state)
    assert found.tolist() == group
    assert state.tolist() == wanted.tolist()
    assert contacts.collides[:count].tolist() == collides.tolist()
    for t in range(5):
        assert not spreading[t] or wanted[t] == COLLIDING
        assert spreading[group[t]] == (wanted[t] == COLLIDING and spreads[group[t]])
    for i in range(count):
        tree = of_contact[i]
        assert group_of_contact(contacts, i, TREES, START, STOP, found) == (group[tree] if tree >= 0 else -1)


def test_the_world_and_what_is_fixed_to_it_have_no_moving_tree() -> None:
    assert [moving_tree(body, TREES, START, STOP) for body in range(-1, 7)] == [-1, 0, 0, 1, -1, 3, 3, 4]
