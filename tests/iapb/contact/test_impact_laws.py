"""Laws of impacts beyond the paper: Coulomb friction and Poisson's law, and the rules that are not sound."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import ArgumentError, resolve_frictional_impact, resolve_impact
from iapb.contact.kernels.unilateral import make_push_work, poisson_impulses


def drawn(seed: int) -> tuple[Any, ...]:
    rng = np.random.default_rng(seed)
    d, c, m = int(rng.integers(2, 8)), int(rng.integers(1, 5)), int(rng.integers(1, 3))
    root = rng.normal(size=(d, d))
    rows, tangents, v = rng.normal(size=(c, d)), rng.normal(size=(c, m, d)), rng.normal(size=d)
    e, mu = float(rng.choice([0.0, 0.4, 1.0])), rng.uniform(0.0, 2.0, c)
    return root @ root.T + 0.1 * np.eye(d), rows, tangents, v, e, mu


@given(st.integers(0, 100_000))
def test_laws_of_every_outcome(seed: int) -> None:
    """Passive, restitution exact, momentum through the contacts only, Coulomb's cone kept."""
    M, J, T, v, e, mu = drawn(seed)
    found = resolve_frictional_impact(M, J, T, v, e, mu)
    energy = 0.5 * v @ M @ v
    assert found.energy_change <= 1e-14 * energy
    met = resolve_impact(M, J, v, e).velocity  # redundant rows: what the normal law itself leaves
    scale = np.abs(J) @ np.abs(v) + np.abs(J) @ np.abs(found.velocity)
    assert np.all(np.abs(J @ (found.velocity - met)) <= 1e-9 * scale)
    p, p_t = found.impulses, found.tangential_impulses
    pushed = J.T @ p + np.einsum("cmd,cm->d", T, p_t)
    size = np.abs(J).T @ np.abs(p) + np.einsum("cmd,cm->d", np.abs(T), np.abs(p_t)) + np.abs(M @ v)
    assert np.all(np.abs(M @ (found.velocity - v) - pushed) <= 1e-8 * size)
    assert np.all(np.linalg.norm(p_t, axis=1) <= mu * np.maximum(p, 0.0) * (1 + 1e-9) + 1e-12 * np.abs(p).max())


def test_a_block_sticks_or_slides() -> None:
    """A point mass thrown at a floor: friction takes at most μ p of the tangential speed."""
    M, J, T = np.eye(2), [[0.0, 1.0]], [[1.0, 0.0]]
    slides = resolve_frictional_impact(M, J, T, [3.0, -1.0], 0.5, 0.4)
    assert slides.velocity == pytest.approx([3.0 - 0.4 * 1.5, 0.5])
    assert slides.tangential_impulses[0, 0] == pytest.approx(-0.6) and slides.friction_share == 1.0
    sticks = resolve_frictional_impact(M, J, T, [0.3, -1.0], 0.5, 0.4)
    assert sticks.velocity == pytest.approx([0.0, 0.5], abs=1e-15)


def test_without_friction_it_is_the_papers_impact() -> None:
    M, J, T, v, e, _ = drawn(5)
    assert resolve_frictional_impact(M, J, T, v, e, 0.0).velocity == pytest.approx(resolve_impact(M, J, v, e).velocity)


def box_on_the_floor(points: Any) -> tuple[Any, Any, Any]:
    """M, J and T of a unit mass whose given corners (c, 3) strike the floor z = 0."""
    arms = np.asarray(points, float)
    jacobians = [np.hstack([np.eye(3), np.cross(np.eye(3), arm)]) for arm in arms]
    M = np.diag([1.0, 1.0, 1.0, 0.02, 0.03, 0.04])
    return M, np.array([j[2] for j in jacobians]), np.array([j[:2] for j in jacobians])


def test_redundant_contacts_settle_and_more_of_them_change_nothing() -> None:
    """Nine points of one face: the normal impulses are not unique, the motion of a flat sliding bounce is."""
    corners = [(x, y, -0.1) for x in (-0.2, 0.2) for y in (-0.3, 0.3)]
    middles = [(x, y, -0.1) for x in (-0.2, 0.0, 0.2) for y in (-0.3, 0.0, 0.3) if x == 0.0 or y == 0.0]
    for v in ([3.0, -1.0, -2.0, 0.0, 0.0, 0.0], [0.05, 0.1, -2.0, 0.0, 0.0, 0.1], [1.0, 0.5, -2.0, 0.3, 0.2, 1.0]):
        four = resolve_frictional_impact(*box_on_the_floor(corners), v, 0.5, 0.3)
        nine = resolve_frictional_impact(*box_on_the_floor(corners + middles), v, 0.5, 0.3)
        assert four.status == nine.status == "complete" and nine.impulses.min() >= 0.0
        if v[3] == v[5] == 0.0:
            assert nine.velocity == pytest.approx(four.velocity, abs=1e-10)


def test_a_lever_that_sticks_takes_few_sweeps() -> None:
    """Tangents a hundred times apart in inertia, and friction that presses the point down: it stops dead."""
    jacobian = np.hstack([np.eye(3), np.cross(np.eye(3), [1.0, 0.0, -0.3])])
    M, J, T = np.diag([1.0, 1.0, 1.0, 0.01, 0.01, 0.01]), jacobian[2:], jacobian[None, :2]
    found = resolve_frictional_impact(M, J, T, [1.0, 1.0, -1.0, 0.0, 0.0, 0.0], 0.0, 8.0)
    assert found.status == "complete"
    assert jacobian @ found.velocity == pytest.approx([0.0, 0.0, 0.0], abs=1e-10)


def test_friction_that_loads_its_own_contact_is_solved_exactly() -> None:
    """A planar contact that slides while μ ∂p_n/∂p_t is 0.9: p_t = −μ p_n, which plain rounds near by a tenth."""
    jacobian = np.array([[1.0, 0.0, 0.9], [0.0, 1.0, 1.0]])  # x and y of the point; turning couples them
    M, v = np.diag([1.0, 1.0, 1.0 / 2.0]), [50.0, -1.0, 0.0]
    coupling = (jacobian @ np.linalg.solve(M, jacobian.T))[0, 1] / (jacobian @ np.linalg.solve(M, jacobian.T))[1, 1]
    found = resolve_frictional_impact(M, jacobian[1:], jacobian[:1], v, 0.0, 0.9 / coupling)
    assert found.status == "complete" and found.friction_share == 1.0
    p, p_t = found.impulses[0], found.tangential_impulses[0, 0]
    assert p_t == pytest.approx(-0.9 / coupling * p, rel=1e-9)
    assert (jacobian @ found.velocity)[1] == pytest.approx(0.0, abs=1e-12)


def test_where_limits_never_settle_friction_is_reduced_and_says_so() -> None:
    """Random strong couplings, μ up to 2: few have no solution that is found; these keep cones, energy, restitution."""
    impacts = [drawn(seed) for seed in range(60)]
    outcomes = [(impact, resolve_frictional_impact(*impact)) for impact in impacts]
    reduced = [(impact, found) for impact, found in outcomes if found.status == "reduced"]
    assert 0 < len(reduced) <= 6
    for (M, J, _, v, e, mu), found in reduced:
        length = np.linalg.norm(found.tangential_impulses, axis=1)
        assert np.all(length <= mu * np.maximum(found.impulses, 0.0) + 1e-12 * np.abs(found.impulses).max())
        assert found.energy_change <= 1e-14 * (v @ M @ v)
        assert J @ found.velocity == pytest.approx(J @ resolve_impact(M, J, v, e).velocity, abs=1e-9)


def test_the_reduction_is_what_prevents_the_gain() -> None:
    """Elastic impacts with friction: whole, it makes some gain energy (Kane and Levinson); reduced, none."""
    impacts = [(*drawn(seed)[:4], 1.0, 0.5) for seed in range(40)]
    kept = [resolve_frictional_impact(*impact) for impact in impacts]
    assert max(found.energy_change for found in kept) <= 1e-12
    gains = []
    for (M, J, _, v, e, _), found in zip(impacts, kept, strict=True):
        if 0.0 < found.friction_share < 1.0:
            bounced = resolve_impact(M, J, v, e).velocity
            whole = bounced + (found.velocity - bounced) / found.friction_share
            gains.append(0.5 * whole @ M @ whole - 0.5 * v @ M @ v)
    assert max(gains) > 1e-3


@pytest.mark.parametrize(
    ("argument", "change"),
    [("tangents", {"tangents": [[1.0, 0.0, 0.0]]}), ("friction", {"friction": -0.1}),
     ("friction", {"friction": [0.1, 0.2]}),
     ("restitution", {"restitution": -0.5}), ("restitution", {"restitution": [0.1]}),
     ("tangents", {"tangents": [[np.nan, 0.0]]})],
)
def test_wrong_arguments_are_named(argument: str, change: dict[str, Any]) -> None:
    given = {"mass_matrix": np.eye(2), "contact_jacobian": [[0.0, 1.0]], "tangents": [[1.0, 0.0]],
             "velocity": [1.0, -1.0], "restitution": 0.5, "friction": 0.3} | change
    with pytest.raises(ArgumentError, match=argument):
        resolve_frictional_impact(**given)


def test_no_contacts() -> None:
    found = resolve_frictional_impact(np.eye(2), [], [], [1.0, -1.0], 0.5, 0.3)
    assert np.array_equal(found.velocity, [1.0, -1.0]) and found.status == "complete"


@pytest.mark.parametrize("power", [-40, 0, 40])
def test_in_a_corner_friction_has_nothing_to_do_in_any_unit_of_mass(power: int) -> None:
    """Where every tangent is the other contact's normal, what is left of it is rounding, however light the mass."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        root, v = rng.normal(size=(2, 2)), rng.normal(size=2)
        M = root @ root.T + 0.1 * np.eye(2)
        normals = np.linalg.qr(rng.normal(size=(2, 2)))[0]
        M, T = 4.0**power * M, normals[::-1, None]
        found = resolve_frictional_impact(M, normals, T, v, 0.3, 0.8)
        plain = resolve_impact(M, normals, v, 0.3)
        assert np.array_equal(found.velocity, plain.velocity)
        assert np.array_equal(found.tangential_impulses, np.zeros((2, 1)))


BAR_MASS = np.diag([1.0, 1.0 / 12.0])
BAR_ROWS = np.array([[1.0, 0.5], [1.0, 0.4]])


def bar_velocity() -> np.ndarray:
    """Falling without turning: γ⁻ = (−1, −1)."""
    return np.linalg.solve(BAR_ROWS, [-1.0, -1.0])


def impact_of(seed: int, d: int = 5, c: int = 7) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    rows = rng.normal(size=(c, min(d, c) - 1)) @ rng.normal(size=(min(d, c) - 1, d))
    return root @ root.T + 0.1 * np.eye(d), rows, rng.normal(size=d), rng.uniform(0.0, 1.0, size=c)


def test_equalities_with_unequal_restitution_gain_energy_on_the_bar() -> None:
    """The counterexample: KE 0.5 → 12.167 when both contacts are made to obey their own e."""
    v = bar_velocity()
    after = np.linalg.solve(BAR_ROWS, [1.0, 0.0])
    assert 0.5 * v @ BAR_MASS @ v == pytest.approx(0.5)
    assert 0.5 * after @ BAR_MASS @ after == pytest.approx(12.1666667)


def test_poissons_law_is_passive_on_the_bar() -> None:
    impact = resolve_impact(BAR_MASS, BAR_ROWS, bar_velocity(), [1.0, 0.0])
    assert impact.law == "Poisson, two LCPs"
    assert impact.energy_change <= 0.0
    assert impact.clamp == 1.0
    assert impact.impulses.min() >= 0.0
    assert (BAR_ROWS @ impact.velocity).min() >= -1e-13


@given(seed=st.integers(0, 100_000), d=st.integers(1, 8), c=st.integers(1, 14))
def test_passive_pushing_and_separating_for_any_restitution(seed: int, d: int, c: int) -> None:
    """Energy falls without the clamp's help; no contact pulls; none approaches afterwards."""
    mass, rows, v, e = impact_of(seed, d, c)
    e = np.append(e[:-1], 1.0 - e[0] / 2) if c > 1 else e
    impact = resolve_impact(mass, rows, v, e, clamp=False)
    if c == 1:
        return  # one value is equal to itself: the scalar rule
    speed = np.sqrt(v @ mass @ v)
    length = np.sqrt(np.einsum("ij,ji->i", rows, np.linalg.solve(mass, rows.T)))
    assert impact.energy_change <= 1e-13 * speed**2
    assert impact.impulses.min() >= 0.0
    assert (rows @ impact.velocity >= -1e-11 * speed * length).all()
    np.testing.assert_allclose(mass @ (impact.velocity - v), rows.T @ impact.impulses, atol=1e-10 * (1 + speed))


@given(seed=st.integers(0, 100_000), e=st.floats(0.0, 1.0))
def test_equal_restitution_reduces_to_the_scalar_rule(seed: int, e: float) -> None:
    """Where all contacts approach and the scalar rule pushes at all, Poisson's law gives the same velocity."""
    rng = np.random.default_rng(seed)
    rows = rng.uniform(0.0, 1.0, size=(3, 5)) + np.eye(3, 5)  # no two rows oppose one another
    u = -rows.T @ rng.uniform(0.1, 1.0, size=3)  # then p = (1 + e) × those weights > 0
    columns = np.ascontiguousarray((rows / np.linalg.norm(rows, axis=1)[:, None]).T)
    p, change = np.zeros(3), np.zeros(5)
    assert poisson_impulses(columns, 3, u, np.full(3, e), p, change, make_push_work(5, 3))
    scalar = resolve_impact(np.eye(5), rows, u, e)
    np.testing.assert_allclose(u + change, scalar.velocity, atol=1e-12)
    assert np.array_equal(resolve_impact(np.eye(5), rows, u, np.full(3, e)).velocity, scalar.velocity)


def test_separating_contacts_are_left_alone() -> None:
    impact = resolve_impact(np.eye(2), np.eye(2), [1.0, 2.0], [0.0, 1.0])
    assert np.array_equal(impact.velocity, [1.0, 2.0])
    assert not impact.impulses.any()


def test_returning_each_contacts_own_share_and_no_more_is_not_sound() -> None:
    """Naive p = (I + E) p_c can leave a contact approaching; Poisson's second LCP repairs it."""
    mass, rows = np.eye(2), np.array([[1.0, 0.0], [-0.8, 0.6]])
    v = np.array([-1.0, -2.0])
    columns = np.ascontiguousarray(rows.T)
    p, change = np.zeros(2), np.zeros(2)
    assert poisson_impulses(columns, 2, v, np.zeros(2), p, change, make_push_work(2, 2))
    naive = v + rows.T @ (p * (1.0 + np.array([1.0, 0.0])))
    assert (rows @ naive).min() < -0.1
    sound = resolve_impact(mass, rows, v, [1.0, 0.0])
    assert (rows @ sound.velocity).min() >= -1e-14


@pytest.mark.parametrize("copies", [2, 10, 300])
def test_copies_of_contacts(copies: int) -> None:
    """Redundant contacts with different restitution: passive, pushing, separating."""
    rng = np.random.default_rng(copies)
    rows = np.tile(BAR_ROWS, (copies, 1))
    impact = resolve_impact(BAR_MASS, rows, bar_velocity(), rng.uniform(0, 1, size=2 * copies), clamp=False)
    assert impact.energy_change <= 1e-14
    assert impact.impulses.min() >= 0.0
    assert (rows @ impact.velocity).min() >= -1e-12


@pytest.mark.parametrize("difference", [1e-5, 1e-8, 1e-10, 1e-12, 1e-14])
@pytest.mark.parametrize("seed", range(5))
def test_nearly_parallel_contacts_converge(difference: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = np.array([1.0, 0.0, 0.0]) + difference * rng.normal(size=(8, 3))
    impact = resolve_impact(np.diag([1.0, 2.0, 3.0]), rows, [-1.0, 0.5, -0.5], rng.uniform(0, 1, 8), clamp=False)
    assert impact.energy_change <= 1e-13
    assert (rows @ impact.velocity).min() >= -1e-10
