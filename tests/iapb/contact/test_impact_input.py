"""What the resolver takes: units and magnitudes change no bit, wrong arguments are named, no input makes a NaN."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb import ArgumentError, IapbError, RangeError, resolve_impact, resolve_impacts


def impact_of(seed: int, d: int = 5, c: int = 7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(d, d))
    rows = rng.normal(size=(c, 3)) @ rng.normal(size=(3, d))
    return root @ root.T + np.eye(d), rows, rng.normal(size=d)


def test_of_a_mass_matrix_with_rounding_in_it_the_symmetric_part_counts() -> None:
    mass, rows, v = impact_of(3)
    skew = 1e-11 * np.triu(mass, 1)
    given = resolve_impact(mass + skew, rows, v, 0.4)
    symmetric = resolve_impact(mass + 0.5 * (skew + skew.T), rows, v, 0.4)
    assert np.allclose(given.velocity, symmetric.velocity, rtol=1e-14, atol=1e-14)
    assert not np.allclose(given.velocity, resolve_impact(mass, rows, v, 0.4).velocity, rtol=1e-14, atol=1e-14)


POWERS = st.lists(st.integers(-60, 60), min_size=7, max_size=7)


@given(seed=st.integers(0, 10_000), powers=POWERS)
def test_row_scale_by_powers_of_two_changes_no_bit(seed: int, powers: list[int]) -> None:
    mass, rows, v = impact_of(seed)
    plain = resolve_impact(mass, rows, v, 0.4)
    scaled = resolve_impact(mass, np.ldexp(rows, np.array(powers)[:, None]), v, 0.4)
    assert np.array_equal(plain.velocity, scaled.velocity)
    assert np.array_equal(plain.generalized_impulse, scaled.generalized_impulse)
    assert plain.rank == scaled.rank


@given(seed=st.integers(0, 10_000), powers=POWERS)
def test_units_of_coordinates_by_powers_of_two_change_no_bit(seed: int, powers: list[int]) -> None:
    """q' = 2^−s q: M' = S M S, J' = J S, v' = S⁻¹ v."""
    mass, rows, v = impact_of(seed)
    s = np.array(powers[:5])
    plain = resolve_impact(mass, rows, v, 0.4)
    scaled = resolve_impact(np.ldexp(mass, s[:, None] + s), np.ldexp(rows, s), np.ldexp(v, -s), 0.4)
    assert np.array_equal(np.ldexp(scaled.velocity, s), plain.velocity)
    assert np.array_equal(np.ldexp(scaled.generalized_impulse, -s), plain.generalized_impulse)
    assert scaled.energy_change == plain.energy_change


@given(seed=st.integers(0, 10_000), speed=st.integers(-400, 300), mass_power=st.integers(-200, 200))
def test_unit_of_time_and_of_mass(seed: int, speed: int, mass_power: int) -> None:
    """Up to energies of 2^1000: above 2^1024 there is no number for them, which is an error by name."""
    mass, rows, v = impact_of(seed)
    plain = resolve_impact(mass, rows, v, 0.4)
    quick = resolve_impact(np.ldexp(mass, 2 * mass_power), rows, np.ldexp(v, speed), 0.4)
    assert np.array_equal(np.ldexp(plain.velocity, speed), quick.velocity)


@pytest.mark.parametrize("method", ["factored", "gram_pinv", "damped", "svd"])
@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e150])
def test_huge_and_tiny_speeds(method: str, size: float) -> None:
    mass, rows, v = impact_of(1)
    impact = resolve_impact(mass, rows, size * v, 0.4, method=method)
    np.testing.assert_allclose(rows @ (impact.velocity / size), -0.4 * (rows @ v), atol=1e-5)


def test_subnormal_speeds() -> None:
    """At 5e-324 a velocity has one bit: the result is the nearest that exists, and no energy appears."""
    least = 5e-324
    assert resolve_impact([[3.0]], [[1.0]], [-least], 1.0).velocity[0] == least
    assert resolve_impact([[3.0]], [[1.0]], [-least], 0.0).velocity[0] == 0.0
    impact = resolve_impact(np.diag([3.0, 1e-300]), [[1.0, 1e-160]], [-1e-310, -1e-310], 0.5)
    assert impact.velocity[0] == pytest.approx(5e-311, rel=1e-12)


@given(
    exponents=st.tuples(*[st.integers(-1000, 1000)] * 3),
    seed=st.integers(0, 1000),
    restitution=st.sampled_from([-1.0, 0.0, 0.5, 1.0]),
)
def test_finite_or_a_named_error(exponents: tuple[int, int, int], seed: int, restitution: float) -> None:
    mass, rows, v = impact_of(seed, d=3, c=4)
    with np.errstate(over="ignore"):
        arrays = [np.ldexp(x, k) for x, k in zip((mass, rows, v), exponents, strict=True)]
    if not all(np.isfinite(x).all() for x in arrays):
        return
    try:
        impact = resolve_impact(*arrays, restitution)
    except RangeError:
        return
    for value in (impact.velocity, impact.generalized_impulse, impact.impulses, impact.energy_change):
        assert np.isfinite(value).all()


def test_mixed_magnitudes_in_one_mass_matrix() -> None:
    """Coordinates in metres and in micro-radians: the mass matrix spans 1e-24 to 1e24."""
    mass, rows, v = impact_of(2)
    s = np.array([1e12, 1e-12, 1.0, 1e6, 1e-6])
    plain = resolve_impact(mass, rows, v, 0.4)
    mixed = resolve_impact(s[:, None] * mass * s, rows * s, v / s, 0.4)
    np.testing.assert_allclose(mixed.velocity * s, plain.velocity, atol=1e-12)


GOOD = {
    "mass_matrix": [[2.0, 0.5], [0.5, 1.0]],
    "contact_jacobian": [[1.0, 0.0], [0.0, 1.0]],
    "velocity": [-1.0, 2.0],
    "restitution": 0.5,
}


def call(**changed: object) -> object:
    return resolve_impact(**{**GOOD, **changed})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("argument", "value", "named"),
    [
        ("mass_matrix", [[1.0, 0.0]], "mass_matrix"),
        ("mass_matrix", [], "mass_matrix"),
        ("mass_matrix", np.zeros((0, 0)), "mass_matrix"),
        ("mass_matrix", 2.0, "mass_matrix"),
        ("mass_matrix", "heavy", "mass_matrix"),
        ("mass_matrix", np.eye(2) * (1 + 1j), "mass_matrix"),
        ("mass_matrix", np.eye(2, dtype=bool), "mass_matrix"),
        ("mass_matrix", [["1", "0"], ["0", "1"]], "mass_matrix"),
        ("mass_matrix", np.array([[1, True], [True, 2]], dtype=object), "mass_matrix"),
        ("mass_matrix", [[10**400, 0], [0, 1]], "mass_matrix"),
        ("contact_jacobian", np.ma.masked_array([[1.0, 0.0]], [[False, True]]), "contact_jacobian"),
        ("velocity", np.array([1, 2], dtype="timedelta64[s]"), "velocity"),
        ("restitution", np.ma.masked_array([0.5, 0.5], [True, False]), "restitution"),
        ("restitution", "0.5", "restitution"),
        ("clamp", "no", "clamp"),
        ("clamp", 0, "clamp"),
        ("mass_matrix", [[1.0, np.nan], [np.nan, 1.0]], "mass_matrix[0, 1]"),
        ("mass_matrix", [[1.0, 0.0], [0.0, np.inf]], "mass_matrix[1, 1]"),
        ("mass_matrix", [[1.0, 0.2], [0.1, 1.0]], "mass_matrix[0, 1]"),
        ("mass_matrix", [[1.0, 0.0], [0.0, 0.0]], "mass_matrix[1, 1]"),
        ("mass_matrix", [[1.0, 0.0], [0.0, -1.0]], "mass_matrix[1, 1]"),
        ("mass_matrix", [[1.0, 3.0], [3.0, 1.0]], "mass_matrix[0, 1]"),
        ("mass_matrix", [[1.0, -3.0], [-3.0, 1.0]], "mass_matrix[0, 1]"),
        ("mass_matrix", [[1.0, 1.1], [1.1, 1.0]], "mass_matrix"),
        ("mass_matrix", [[1.0, 1.0], [1.0, 1.0]], "mass_matrix"),
        ("mass_matrix", [[1e-300, 1e300], [1e300, 1e-300]], "mass_matrix[0, 1]"),
        ("mass_matrix", [[1e-300, 1e300], [-1e300, 1e-300]], "mass_matrix[0, 1]"),
        ("velocity", [1.0], "velocity"),
        ("velocity", [[1.0, 2.0]], "velocity"),
        ("velocity", [np.nan, 1.0], "velocity[0]"),
        ("velocity", [1.0, -np.inf], "velocity[1]"),
        ("velocity", None, "velocity"),
        ("contact_jacobian", [[1.0]], "contact_jacobian"),
        ("contact_jacobian", [1.0, 2.0], "contact_jacobian"),
        ("contact_jacobian", np.zeros((3, 0)), "contact_jacobian"),
        ("contact_jacobian", np.zeros((0, 5)), "contact_jacobian"),
        ("contact_jacobian", [[1.0, 2.0], [3.0]], "contact_jacobian"),
        ("contact_jacobian", [[1.0, np.inf]], "contact_jacobian[0, 1]"),
        ("restitution", 1.0000001, "restitution"),
        ("restitution", -1.0000001, "restitution"),
        ("restitution", np.nan, "restitution"),
        ("restitution", "elastic", "restitution"),
        ("restitution", None, "restitution"),
        ("restitution", [0.5], "restitution"),
        ("restitution", [[0.5, 0.5]], "restitution"),
        ("restitution", [0.5, -0.1], "restitution[1]"),
        ("restitution", [1.1, 0.5], "restitution[0]"),
        ("restitution", [0.5, np.nan], "restitution[1]"),
        ("restitution", [-2.0, -2.0], "restitution[0]"),
        ("method", "magic", "method"),
        ("method", ["factored"], "method"),
        ("budget", -1, "budget"),
        ("budget", 1.5, "budget"),
        ("budget", True, "budget"),
        ("rank_tolerance", 0.0, "rank_tolerance"),
        ("rank_tolerance", 1.0, "rank_tolerance"),
        ("rank_tolerance", np.nan, "rank_tolerance"),
        ("rank_tolerance", "tight", "rank_tolerance"),
        ("rank_tolerance", [1e-8], "rank_tolerance"),
    ],
)
def test_a_wrong_argument_is_named(argument: str, value: object, named: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        call(**{argument: value})
    assert caught.value.argument == named
    assert str(caught.value).startswith(f"{named} = ") and "expected" in str(caught.value)


def test_a_budget_needs_the_anytime_method() -> None:
    with pytest.raises(ArgumentError, match="budget"):
        call(budget=1, method="svd")
    with pytest.raises(ArgumentError, match="budget"):
        call(budget=1, restitution=[0.1, 0.2])


@pytest.mark.parametrize("copies", [[[1.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], [[1.0, 0], [0, 1], [1, 1]]])
def test_gram_cholesky_refuses_dependent_rows(copies: list[list[float]]) -> None:
    with pytest.raises(ArgumentError, match="independent rows") as caught:
        call(contact_jacobian=copies, method="gram_cholesky")
    assert caught.value.argument == "contact_jacobian"


def test_overflow_is_a_named_error() -> None:
    with pytest.raises(RangeError) as caught:
        resolve_impact([[1.0]], [[1.0]], [-1e200], 0.0)  # ½ v² is beyond doubles
    assert caught.value.quantity == "energy_change"
    with pytest.raises(RangeError) as caught:
        resolve_impact([[1e200]], [[1.0]], [-1e200], 0.0)
    assert caught.value.quantity == "generalized_impulse"
    with pytest.raises(RangeError) as caught:
        resolve_impact([[1.0]], [[1e-300]], [-1e100], 0.0)
    assert caught.value.quantity == "impulses"


def test_every_error_has_the_common_root() -> None:
    assert issubclass(ArgumentError, IapbError) and issubclass(RangeError, IapbError)
    assert issubclass(ArgumentError, ValueError) and issubclass(RangeError, OverflowError)


@pytest.mark.parametrize("rows", [[], (), np.zeros(0), np.zeros((0, 2))])
def test_no_rows_in_any_form_leave_the_velocity_as_it_is(rows: object) -> None:
    assert np.array_equal(call(contact_jacobian=rows).velocity, call(contact_jacobian=np.zeros((0, 2))).velocity)


def test_fractions_and_whole_numbers_in_object_arrays_are_numbers() -> None:
    """GOOD, exactly, as objects: the same impact to the bit."""
    exact = np.array([[2, Fraction(1, 2)], [Fraction(1, 2), 1]], dtype=object)
    moved = call(mass_matrix=exact, velocity=np.array([-1, 2], dtype=object))
    assert np.array_equal(moved.velocity, call().velocity)


@given(seed=st.integers(0, 10_000), d=st.integers(1, 6), c=st.integers(0, 8), clamp=st.booleans(),
       budget=st.none() | st.integers(0, 6), tolerance=st.sampled_from([None, 1e-6]))
def test_many_at_once_are_those_one_by_one_bit_for_bit(
    seed: int, d: int, c: int, clamp: bool, budget: int | None, tolerance: float | None
) -> None:
    rng = np.random.default_rng(seed)
    n = 5
    root = rng.normal(size=(n, d, d))
    masses = root @ root.transpose(0, 2, 1) + 10.0 ** rng.uniform(-9, 0) * np.eye(d)
    rows = rng.normal(size=(n, c, d)) * 10.0 ** rng.uniform(-6, 6, (n, c, 1))
    rows[:, 2:4] = rows[:, 1:2]
    v, e = rng.normal(size=(n, d)) * 10.0 ** rng.uniform(-300, 9, (n, 1)), rng.uniform(-1.0, 1.0, n)
    options = {"clamp": clamp, "budget": budget, "rank_tolerance": tolerance}
    found = resolve_impacts(masses, rows, v, e, **options)  # type: ignore[arg-type]
    for k in range(n):
        single = resolve_impact(masses[k], rows[k], v[k], e[k], **options)  # type: ignore[arg-type]
        for name in ("velocity", "generalized_impulse", "impulses", "energy_interval", "rank", "energy_change", "clamp",
                     "status"):
            np.testing.assert_array_equal(getattr(found, name)[k], getattr(single, name), strict=False)


STACKED = {"mass_matrices": np.array([np.eye(2)] * 3), "contact_jacobians": np.ones((3, 1, 2)),
           "velocities": -np.ones((3, 2)), "restitution": 0.5}


@pytest.mark.parametrize(("argument", "value", "named"), [
    ("mass_matrices", np.eye(2), "mass_matrices"),
    ("mass_matrices", np.ones((2, 2, 2)), "mass_matrices"),
    ("mass_matrices", [np.eye(2), np.eye(2), [[1.0, 0.0], [0.0, np.nan]]], "mass_matrices[2, 1, 1]"),
    ("mass_matrices", [np.eye(2), np.ones((2, 2)), np.eye(2)], "mass_matrices[1]"),
    ("contact_jacobians", np.ones((3, 1, 3)), "contact_jacobians"),
    ("contact_jacobians", np.full((3, 1, 2), np.inf), "contact_jacobians[0, 0, 0]"),
    ("velocities", "fast", "velocities"),
    ("velocities", [[0.0, 0.0], [0.0, np.nan], [0.0, 0.0]], "velocities[1, 1]"),
    ("restitution", [0.5, 1.5, 0.5], "restitution[1]"),
    ("restitution", np.nan, "restitution"),
    ("restitution", [0.5, 0.5], "restitution"),
    ("budget", -1, "budget"),
    ("clamp", 1, "clamp"),
    ("rank_tolerance", 2.0, "rank_tolerance"),
])
def test_the_wrong_one_of_many_is_named(argument: str, value: object, named: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        resolve_impacts(**{**STACKED, argument: value})  # type: ignore[arg-type]
    assert caught.value.argument == named


def test_an_overflow_among_many_is_named() -> None:
    with pytest.raises(RangeError) as caught:
        resolve_impacts(**{**STACKED, "velocities": [[-1.0, -1.0], [-1e200, 0.0], [0.0, 0.0]]})  # type: ignore[arg-type]
    assert caught.value.quantity == "energy_change[1]"


def test_none_at_all_are_resolved_too() -> None:
    assert resolve_impacts(np.zeros((0, 2, 2)), np.zeros((0, 4, 2)), np.zeros((0, 2)), 0.5).velocity.shape == (0, 2)


def test_many_impacts_take_what_one_takes() -> None:
    """No rows as [], clamp=None and a budget beyond 64 bits: as in `resolve_impact`, which takes any budget."""
    mass, rows, v = (np.asarray(GOOD[name]) for name in ("mass_matrix", "contact_jacobian", "velocity"))
    free = resolve_impacts([mass], [], [v], 0.5)
    assert free.velocity.tolist() == [v.tolist()] and free.impulses.shape == (1, 0)
    one, plain = resolve_impact(mass, rows, v, 0.5, budget=10**30), resolve_impact(mass, rows, v, 0.5)
    many = resolve_impacts([mass], [rows], [v], 0.5, budget=10**30, clamp=None)
    assert one.rows_used == 10**30
    assert one.velocity.tolist() == plain.velocity.tolist() == many.velocity[0].tolist()


@pytest.mark.parametrize("mass", [[[1.0, np.nan], [2.0, 1.0]], [[1.0, 0.2], [0.1, 1.0]], [[1.0, 0.0], [0.0, -3.0]],
                                  [[1.0, 7.0], [7.0, 1.0]]])
def test_the_entry_that_is_named_is_the_one_that_is_shown(mass: list[list[float]]) -> None:
    with pytest.raises(ArgumentError) as caught:
        call(mass_matrix=mass)
    i, j = (int(caught.value.argument[k]) for k in (-5, -2))
    assert caught.value.argument == f"mass_matrix[{i}, {j}]"
    assert np.array_equal(caught.value.value, mass[i][j], equal_nan=True)


def test_restitution_on_the_ends_of_its_range_and_the_same_for_each_contact() -> None:
    for e in (-1.0, 1.0):
        many = resolve_impacts(**{**STACKED, "restitution": [e, e, e]})  # type: ignore[arg-type]
        np.testing.assert_allclose(many.velocity, e, atol=1e-15)
    for e in (-0.5, 0.5, 1.0, -1.0):
        same, scalar = call(restitution=[e, e]), call(restitution=e)
        assert (same.law, same.velocity.tolist()) == (scalar.law, scalar.velocity.tolist())  # type: ignore[attr-defined]
    with pytest.raises(ArgumentError, match="contacts differ"):
        call(restitution=[0.0, 1.5])
    assert call(restitution=[0.0, 1.0]).status == call(restitution=[1.0, 0.0]).status == "complete"  # type: ignore[attr-defined]


@pytest.mark.parametrize("v", [[0.0, 0.0], [1.0, 1.0]])
def test_at_rest_or_parting_poissons_law_is_met_without_impulses(v: list[float]) -> None:
    impact = call(velocity=v, restitution=[0.2, 0.9])
    assert impact.status == "complete" and impact.velocity.tolist() == v  # type: ignore[attr-defined]
    assert not impact.impulses.any() and impact.rank == 0 and impact.clamp == 1.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(("share", "rank"), [(0.1, 2), (1e-3, 1)])
def test_the_cutoff_of_the_printed_formula_is_a_share_of_the_largest_singular_value(share: float, rank: int) -> None:
    """W of a hundred copies of one row and of one across: singular values 100 and share, cut off at 1e-4 of 100."""
    rows = np.vstack((np.tile([1.0, 0.0], (100, 1)), [[0.0, np.sqrt(share)]]))
    impact = resolve_impact(np.eye(2), rows, [-1.0, -1.0], 0.5, method="gram_pinv", rank_tolerance=1e-4)
    assert impact.rank == rank
    np.testing.assert_allclose(impact.velocity, [0.5, 0.5 if rank == 2 else -1.0], atol=1e-12)


@pytest.mark.parametrize("method", ["gram_pinv", "gram_cholesky", "damped", "svd", "factored", "poisson"])
@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e5])
def test_every_method_solves_two_rows_across_each_other(method: str, scale: float) -> None:
    """M = diag(2, 4), J = diag(3, −5), e = ½: P = −1.5 M v, p = J⁻ᵀ P, and ⅜ of each part of the energy is lost."""
    mass, rows, v = np.diag([2.0, 4.0]), scale * np.diag([3.0, -5.0]), np.array([-1.0, 2.0])
    impact = resolve_impact(mass, rows, v, 0.5, method=method)
    tolerance = 1e-7 if method == "damped" else 1e-12  # λ is 1e-8 of the largest entry of W
    np.testing.assert_allclose(impact.velocity, -0.5 * v, rtol=tolerance)
    np.testing.assert_allclose(impact.generalized_impulse, -1.5 * mass @ v, rtol=tolerance)
    np.testing.assert_allclose(impact.impulses, np.linalg.solve(rows.T, -1.5 * mass @ v), rtol=tolerance)
    assert impact.energy_change == pytest.approx(-0.375 * (v @ mass @ v), rel=tolerance)
    assert (impact.rank, impact.status, impact.method, impact.rows_used) == (2, "complete", method, None)
    assert impact.clamp == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("restitution", [np.nan, 2.0, -1.5])
def test_a_wrong_restitution_of_no_impacts_is_refused(restitution: float) -> None:
    with pytest.raises(ArgumentError, match="^restitution = "):
        resolve_impacts(np.zeros((0, 3, 3)), np.zeros((0, 2, 3)), np.zeros((0, 3)), restitution)
