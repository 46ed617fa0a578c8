"""What the resolver refuses: every error names the argument, and no input makes a NaN or an infinity."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import ArgumentError, IapbError, RangeError, resolve_impact

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
