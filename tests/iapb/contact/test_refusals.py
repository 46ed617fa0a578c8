"""What each border refuses, by the name of the wrong argument: impacts, many impacts, friction,
laws."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from iapb import RangeError, resolve_frictional_impact, resolve_impact, resolve_impacts
from iapb.contact.laws import ImpulseAugmented, Penalty
from iapb.errors import ArgumentError, IapbError
from iapb.scene import find_scene, load_scene
from iapb.system import System
from tests.given import data_of

NAN = float("nan")
ONE = {
    "mass_matrix": [[2.0, 0.5], [0.5, 1.0]],
    "contact_jacobian": np.eye(2),
    "velocity": [-1.0, 2.0],
    "restitution": 0.5,
}
MANY = {
    "mass_matrices": np.array([np.eye(2)] * 3),
    "contact_jacobians": np.ones((3, 1, 2)),
    "velocities": -np.ones((3, 2)),
    "restitution": 0.5,
}
RUBBING = ONE | {"tangents": np.eye(2)[::-1], "friction": 0.3}
BORDERS = {
    "one": (resolve_impact, ONE),
    "many": (resolve_impacts, MANY),
    "friction": (resolve_frictional_impact, RUBBING),
}

GIVEN = data_of(__file__, "refused.yaml")
REFUSED = [
    (border, argument, value, place)
    for borders, arguments in GIVEN.items()
    for border in borders.split(", ")
    for argument, rows in arguments.items()
    for value, place in rows
]
REFUSED += [  # what YAML cannot say
    ("one", "mass_matrix", np.eye(2) * (1 + 1j), ""),
    ("one", "mass_matrix", [[10**400, 0], [0, 1]], "[0, 0]"),
    ("one", "velocity", np.array([1, 2], dtype="timedelta64[s]"), ""),
    ("one", "contact_jacobian", np.ma.masked_array([[1.0, 0.0]], [[False, True]]), ""),
    ("one", "restitution", np.ma.masked_array([0.5, 0.5], [True, False]), ""),
    ("one", "restitution", 10**400, ""),
]


@pytest.mark.parametrize(("border", "argument", "value", "place"), REFUSED)
def test_a_wrong_argument_is_named(border: str, argument: str, value: Any, place: str) -> None:
    call, given = BORDERS[border]
    with pytest.raises(ArgumentError) as caught:
        call(**given | {argument: value})
    assert caught.value.argument == argument + place
    assert str(caught.value).startswith(f"{argument}{place} = ") and "expected" in str(caught.value)


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"budget": 1, "restitution": [0.1, 0.2]}, "budget"),
        ({"budget": 1, "method": "poisson"}, "budget"),
        ({"method": "poisson", "restitution": -0.1}, "restitution"),
    ],
)
def test_arguments_that_do_not_go_together(changed: dict[str, Any], named: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        resolve_impact(**ONE | changed)  # type: ignore[arg-type]
    assert caught.value.argument == named


@pytest.mark.parametrize("value", [NAN, 2.0, -1.5])
def test_a_wrong_restitution_of_no_impacts_is_refused_too(value: float) -> None:
    empty = {
        "mass_matrices": np.zeros((0, 3, 3)),
        "contact_jacobians": np.zeros((0, 2, 3)),
        "velocities": np.zeros((0, 3)),
        "restitution": 0.5,
    }
    assert resolve_impacts(**empty).velocity.shape == (0, 3)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="^restitution = "):
        resolve_impacts(**empty | {"restitution": value})  # type: ignore[arg-type]


HUGE = 1.7e308
OVERFLOWS: list[tuple[Any, Any, Any, str]] = [
    ([[1.0, 0.9], [0.9, 1.0]], [[1.0, 0.0]], [HUGE, HUGE], "velocity"),
    (1e200 * np.eye(2), [[1.0, 0.0]], [-1e200, 0.0], "generalized_impulse"),
    (np.eye(2), [[1e-300, 0.0]], [-1e100, 0.0], "impulses"),
    (np.eye(2), [[1.0, 0.3]], [-1e200, 0.0], "energy_change"),
]


@pytest.mark.parametrize(("M", "J", "v", "quantity"), OVERFLOWS)
def test_a_result_beyond_doubles_is_named(M: Any, J: Any, v: Any, quantity: str) -> None:
    with pytest.raises(RangeError) as caught:
        resolve_impact(M, J, v, 1.0)
    assert caught.value.quantity == quantity
    with pytest.raises(RangeError) as caught:
        resolve_impacts([np.eye(2), M], [J, J], [[-1.0, 0.0], v], 1.0)
    assert caught.value.quantity == f"{quantity.replace('velocity', 'velocities')}[1]"


SIZES = (5e-324, 1e-310, 1e-160, 1e-30, 1.0, 1e30, 1e160, HUGE)


def sized(rng: np.random.Generator, array: Any) -> Any:
    """Scale an array by one size, or each entry by its own; keep it finite."""
    shape = array.shape if rng.random() < 0.2 else None
    with np.errstate(over="ignore", under="ignore"):
        return np.clip(array * rng.choice(SIZES, size=shape), -HUGE, HUGE)


@pytest.mark.parametrize("kind", ["definite", "singular", "indefinite", "asymmetric", "zero"])
def test_every_finite_input_gives_a_finite_velocity_or_an_error_by_name(kind: str) -> None:
    rng = np.random.default_rng(len(kind))
    ended = {"velocity": 0, "error": 0}
    for _ in range(300):
        d = int(rng.integers(1, 7))
        root = rng.normal(size=(d, d))
        mass = {
            "definite": root @ root.T + np.eye(d),
            "singular": np.outer(root[0], root[0]),
            "indefinite": root + root.T,
            "asymmetric": root,
            "zero": np.zeros((d, d)),
        }[kind]
        rows = rng.integers(-1, 2, size=(int(rng.integers(0, 2 * d)), d)).astype(float)
        given = (sized(rng, array) for array in (mass, rows, rng.normal(size=d)))
        try:
            velocity = resolve_impact(*given, float(rng.choice([-1.0, 0.0, 0.3, 1.0]))).velocity
        except IapbError:
            ended["error"] += 1
        else:
            assert velocity.shape == (d,) and np.all(np.isfinite(velocity))
            ended["velocity"] += 1
    assert ended["error"] > 0 and (kind != "definite" or ended["velocity"] > 100)


@pytest.mark.parametrize("rows", [[], (), np.zeros(0), np.zeros((0, 2))])
def test_no_rows_in_any_form_leave_the_velocity_as_it_is(rows: Any) -> None:
    for found in (
        resolve_impact(**ONE | {"contact_jacobian": rows}),  # type: ignore[arg-type]
        resolve_frictional_impact(ONE["mass_matrix"], rows, rows, ONE["velocity"], 0.5, 0.3),
    ):
        assert np.array_equal(found.velocity, [-1.0, 2.0]) and found.impulses.shape == (0,)
    assert resolve_impacts([ONE["mass_matrix"]], [], [ONE["velocity"]], 0.5).velocity.tolist() == [
        [-1.0, 2.0]
    ]


def test_fractions_and_whole_numbers_in_object_arrays_are_numbers() -> None:
    exact = np.array([[2, Fraction(1, 2)], [Fraction(1, 2), 1]], dtype=object)
    found = resolve_impact(exact, np.eye(2), np.array([-1, 2], dtype=object), 0.5)
    assert np.array_equal(found.velocity, resolve_impact(**ONE).velocity)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "values", "named"),
    [
        (Penalty, {"integrator": "euler"}, "integrator"),
        (ImpulseAugmented, {"friction_in_impacts": "yes"}, "friction_in_impacts"),
        (ImpulseAugmented, {"pushing": True, "friction_in_impacts": True}, "pushing"),
    ],
)
def test_settings_of_a_law(make: Any, values: dict[str, Any], named: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        make(**values)
    assert caught.value.argument == named


def test_a_step_other_than_the_scenes_is_refused() -> None:
    system = System(load_scene(find_scene("peg_corner")))
    with pytest.raises(ArgumentError) as caught:
        Penalty().advance(system, system.make_state(), np.zeros(3), 0.1)
    assert caught.value.argument == "dt"
