"""The exact judge of recorded impacts finds every gain of one unit in the last place, and nothing
else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import iapb
import verification.certificate
from iapb import (
    ArgumentError,
    IapbError,
    certify,
    certify_impacts,
    find_scene,
    load_scene,
    simulate,
)
from iapb.contact.laws import ImpulseAugmented
from iapb.run import Run, digests
from iapb.scene import scene_from_text
from verification.certificate import exact_gain, exported_run, judge_gains


def near_the_border(
    n: int, d: int, rng: np.random.Generator, decades: float
) -> tuple[np.ndarray, ...]:
    """M asymmetric in the last bit, v and w = ±v with one unit in the last place planted in one
    entry: gain or loss."""
    root = rng.normal(size=(n, d, d))
    mass = np.nextafter(
        root @ root.transpose(0, 2, 1), np.where(rng.random((n, d, d)) < 0.5, np.inf, -np.inf)
    )
    v = rng.normal(size=(n, d)) * 10.0 ** rng.uniform(-decades, decades, (n, 1))
    w = np.where(rng.random((n, 1)) < 0.5, v, -v)
    entry = rng.integers(0, d, n)
    towards = np.where(rng.random(n) < 0.5, np.inf, -np.inf)
    w[np.arange(n), entry] = np.nextafter(w[np.arange(n), entry], towards)
    same = rng.random(n) < 0.1  # w = −v gains nothing and loses nothing
    w[same] = -v[same]
    return mass, v, w


def fractions_gain(mass: np.ndarray, before: np.ndarray, after: np.ndarray) -> Fraction:
    """KE⁺ − KE⁻ by rationals, entry by entry."""
    M, v, w = map(np.vectorize(Fraction, otypes=[object]), (mass, before, after))
    gain: Fraction = (w @ M @ w - v @ M @ v) / 2
    return gain


@pytest.mark.parametrize("decades", [0, 250])
def test_every_impact_is_judged_as_rationals_judge_it(decades: int) -> None:
    impacts = near_the_border(200, 3, np.random.default_rng(1), decades)
    truth = [fractions_gain(*one) for one in zip(*impacts, strict=True)]
    assert [exact_gain(*one) for one in zip(*impacts, strict=True)] == truth
    assert judge_gains(*impacts).gained.tolist() == [gain > 0 for gain in truth]
    assert 25 < sum(gain > 0 for gain in truth) < 175
    assert exact_gain(np.eye(2), [5e-324, 1e308], [1e308, 5e-324]) == 0
    assert exact_gain(np.zeros((2, 2)), [1.0, 2.0], [3.0, 4.0]) == 0


def test_planted_gains_of_one_unit_in_the_last_place_are_all_found() -> None:
    """v⁺ = −v keeps the energy exactly; one unit in the last place along the momentum gains, the
    other way loses."""
    mass, v, _ = near_the_border(2000, 3, np.random.default_rng(2), 0.0)
    mass = mass + np.eye(3)
    w = -v
    rng = np.random.default_rng(3)
    momentum = np.einsum("nij,nj->ni", mass, w)
    planted = rng.choice(2000, 100, replace=False)
    widest = np.abs(momentum).argmax(axis=1)
    for k in range(2000):
        towards = np.inf if (momentum[k, widest[k]] > 0.0) == (k in planted) else -np.inf
        w[k, widest[k]] = np.nextafter(w[k, widest[k]], towards)
    found = certify_impacts(mass, v, w)
    assert np.flatnonzero(judge_gains(mass, v, w).gained).tolist() == sorted(planted.tolist())
    assert found.gains == 100 and not found.passed and found.first_gain == min(planted)
    space: dict[str, object] = {"print": lambda value: space.update(shown=value)}
    exec(found.counterexample, space)
    assert space["shown"] > 0  # type: ignore[operator]


def test_gains_below_any_bound_are_left_to_integers() -> None:
    """A gain of 2^-200 of the energy: no double-double sees it."""
    mass = np.eye(2)
    v = np.array([[1.0, 2.0**-100]])
    judged = judge_gains(mass, v, np.array([[-1.0, 2.0**-99]]))
    assert judged.gained.tolist() == [True]
    assert judge_gains(mass, v, np.array([[-1.0, 2.0**-101]])).gained.tolist() == [False]
    cancelling = np.ones((2, 2)), [1.0, 2.0**-80], [1.0 + 2.0**-52, -(2.0**-52)]
    assert judge_gains(*cancelling).gained.tolist() == [exact_gain(*cancelling) > 0]


def test_a_bound_that_disagrees_with_integers_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(masses: np.ndarray, before: np.ndarray, after: np.ndarray, signs: np.ndarray) -> None:
        signs[:] = 1

    monkeypatch.setattr(verification.certificate, "gain_signs", wrong)
    with pytest.raises(IapbError, match="outside its double-double bounds"):
        judge_gains(np.eye(2), [[1.0, 1.0]], [[0.5, 0.5]])


@pytest.mark.parametrize(
    ("change", "argument"),
    [
        ({"v_plus": [[1.0, 2.0, 3.0]]}, "v_plus"),
        ({"mass_matrix": np.eye(3)}, "mass_matrix"),
        ({"v_minus": [[np.nan, 1.0]]}, r"v_minus\[0, 0\] = nan"),
        ({"impulse": [[np.nan, 1.0]]}, "impulse"),
        ({"v_minus": np.ones((9, 0))}, "d > 0"),
        ({"mass_matrix": [[1.0, 2.0], [2.0, 1.0]]}, "impact 0.*negative"),
        ({"mass_matrix": [["1", "0"], ["0", "1"]]}, "mass_matrix.*real numbers"),
        ({"mass_matrix": np.ma.masked_array(np.eye(2), mask=True)}, "mass_matrix.*real numbers"),
        ({"mass_matrix": np.eye(2) * (1.0 + np.longdouble(1e-18))}, "finite number"),
    ],
)
def test_wrong_arrays_are_refused_by_name(change: dict[str, object], argument: str) -> None:
    good: dict[str, object] = {
        "mass_matrix": np.eye(2),
        "v_minus": [[1.0, 1.0]],
        "v_plus": [[0.5, 0.5]],
    }
    with pytest.raises(ArgumentError, match=argument):
        certify_impacts(**(good | change))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def cradle() -> Run:
    return simulate(
        load_scene(find_scene("newton_cradle")).with_values({"contact.restitution": 1.0})
    )


def forged(run: Run, where: str, value: Any, at: Any = 0) -> Run:
    """The run with one entry of an array multiplied by a number, or replaced if it is one that is
    not finite."""
    table, _, name = where.rpartition(".")
    part = getattr(run, table) if table else run
    array = getattr(part, name).copy()
    array[at] = array[at] * value if np.isfinite(value) else value
    return (
        replace(run, **{table: replace(part, **{name: array})})
        if table
        else replace(part, **{name: array})
    )


def kept(run: Run, count: int) -> Run:
    """The run with the first impacts of its record alone."""
    table = run.impacts
    return replace(
        run,
        impacts=replace(table, **{f.name: getattr(table, f.name)[:count] for f in fields(table)}),
    )


def scaled(share: float) -> Callable[[Run], Run]:
    """A share of every change of velocity: no gain, momentum and range(Jᵀ) fit, but no impact of the
    scene's e."""

    def forge(run: Run) -> Run:
        table = run.impacts
        slower = table.v_minus + share * (table.v_plus - table.v_minus)
        return replace(
            run,
            impacts=replace(table, v_plus=slower, impulse=share * table.impulse),
            impulse=share * run.impulse,
            contacts=replace(run.contacts, impulse=share * run.contacts.impulse),
        )

    return forge


BOTH_ENDS = {  # of the cradle are struck in one step
    "bodies.ball_5.position": [0.117578125, 0, 0],
    "bodies.ball_5.velocity": [-1, 0, 0],
}


@pytest.mark.parametrize(
    ("name", "values", "rendering"),
    [
        ("newton_cradle", {}, "full"),
        ("newton_cradle", BOTH_ENDS, "full"),
        ("three_link_arm_elastic", {"duration": 0.5}, "full"),  # M of a moving arm
        ("peg_corner", {}, "scale"),  # to a device: shares of an impulse, as they are applied
    ],
)
def test_a_run_of_the_engine_is_certified(name: str, values: Any, rendering: str) -> None:
    scene = load_scene(find_scene(name)).with_values({"contact.restitution": 1.0} | values)
    run = simulate(scene, ImpulseAugmented(rendering=rendering))
    found = certify(run)
    assert found.impacts == len(run.impacts.step) > 0 and found.passed and found.gains == 0
    assert "not in the last bit" in found.words()
    assert (run.impacts.scale < 1.0).any() == (rendering == "scale") != found.restitution_judged
    assert max(found.momentum, found.span, found.total, found.restitution) < 1e-12


# what is forged, and the residuals that fail; none of them gains energy but the first
FORGED: dict[str, tuple[Callable[[Run], Run], set[str]]] = {
    "faster": (lambda run: forged(run, "impacts.v_plus", 1.0 + 1e-8), {"gains", "momentum"}),
    "impulse of an impact": (
        lambda run: forged(run, "impacts.impulse", 1.0 + 1e-6),
        {"momentum", "total"},
    ),
    "impulse of a step": (
        lambda run: forged(run, "impulse", 1.0 + 1e-6, run.impacts.step[0]),
        {"total", "span"},
    ),
    "impulse of a contact": (
        lambda run: forged(
            run, "contacts.impulse", 1.0 + 1e-6, np.flatnonzero(run.contacts.impulse)[0]
        ),
        {"span"},
    ),
    "no impact": (lambda run: kept(run, 0), {"total"}),
    "one impact": (lambda run: kept(run, 1), {"total"}),
    "another e": (scaled(1.0 - 1e-5), {"restitution"}),
}


@pytest.mark.parametrize("batch", [4096, 3])
@pytest.mark.parametrize("name", FORGED)
def test_what_is_forged_in_a_record_fails_in_its_residual(
    cradle: Run, name: str, batch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if the impacts are judged in batches of a few."""
    monkeypatch.setattr(verification.certificate, "_BATCH", batch)
    monkeypatch.setattr(verification.certificate, "_PIECE", batch * 64)
    forge, failing = FORGED[name]
    found = certify(forge(cradle))
    limits = {"gains": 0.0, "momentum": 1e-9, "span": 1e-9, "total": 1e-9, "restitution": 1e-6}
    assert {name for name, limit in limits.items() if getattr(found, name) > limit} == failing
    assert not found.passed and ("fit" in found.words()) == (failing != {"gains"})


class Stored:
    """An array as of a file, which can only be read in slices; it keeps the most rows that one read
    takes."""

    def __init__(self, array: np.ndarray) -> None:
        self._array = array
        self.shape = array.shape
        self.most = 0

    def __len__(self) -> int:
        return len(self._array)

    def __getitem__(self, rows: slice) -> np.ndarray:
        found = self._array[rows]
        self.most = max(self.most, len(found))
        return found


def stored(table: Any) -> Any:
    return replace(
        table, **{each.name: Stored(getattr(table, each.name)) for each in fields(table)}
    )


def test_a_long_run_is_certified_and_exported_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory does not grow with what is recorded of contacts, impulses and velocities."""
    given = simulate(load_scene(find_scene("arm_obstacles")))
    lines = list(exported_run(given))
    monkeypatch.setattr(verification.certificate, "_BATCH", 2)
    whole = certify(given)
    monkeypatch.setattr(verification.certificate, "_PIECE", 1000)
    run = replace(
        given,
        impulse=Stored(given.impulse),
        contacts=stored(given.contacts),
        impacts=stored(given.impacts),
    )
    assert list(exported_run(run)) == lines
    assert max(getattr(run.contacts, each.name).most for each in fields(run.contacts)) == 0
    assert certify(run) == whole
    assert 0 < run.impulse.most < len(run.impulse) // 10
    for name in ("body_a", "body_b", "point", "normal", "impulse"):
        column = getattr(run.contacts, name)
        assert 0 < column.most < len(column) // 4
    for name in ("q", "v_minus", "v_plus", "impulse", "scale", "mass_digest"):
        column = getattr(run.impacts, name)
        assert 0 < column.most < len(column)


@pytest.mark.parametrize(
    "offsets",
    [
        lambda given: given[:-1],
        lambda given: given[:0],
        lambda given: given[::-1],
        lambda given: given + 1,
        lambda given: given - 1,
    ],
)
def test_offsets_that_do_not_fit_the_steps_are_refused_in_a_sentence(
    cradle: Run, offsets: Callable[[np.ndarray], np.ndarray]
) -> None:
    wrong = replace(cradle.contacts, offsets=offsets(cradle.contacts.offsets))
    with pytest.raises(ArgumentError, match=r"contacts\.offsets.*that never fall"):
        certify(replace(cradle, contacts=wrong))


def test_restitution_is_judged_under_the_plain_law_alone(cradle: Run) -> None:
    half = scaled(0.5)(cradle)
    budgeted = certify(replace(half, impacts=replace(half.impacts, rank=half.impacts.rows - 1)))
    assert (
        not budgeted.restitution_judged
        and "restitution (only reported)" in budgeted.words()
        and budgeted.passed
    )
    pushing = certify(
        simulate(load_scene(find_scene("newton_cradle")), ImpulseAugmented(pushing=True))
    )
    assert pushing.passed and "Not judged: restitution" in pushing.words()


@pytest.mark.parametrize(
    "where",
    [
        "impacts.v_plus",
        "impacts.scale",
        "contacts.normal",
        "impulse",
    ],
)
def test_records_that_are_not_finite_are_refused_by_name(cradle: Run, where: str) -> None:
    at = np.flatnonzero(cradle.contacts.impulse)[0] if where.startswith("contacts") else 0
    with pytest.raises(ArgumentError, match=where):
        certify(forged(cradle, where, np.inf, at))


def test_mass_matrix_that_is_made_again_must_be_the_recorded_one(cradle: Run) -> None:
    """A configuration, a digest or the scene changed in the last bit: M is not the one whose digest
    is recorded."""
    table = cradle.impacts
    assert np.array_equal(table.time, cradle.time[table.step])
    assert np.array_equal(table.q, cradle.q[table.step])
    assert (
        table.mass_digest.all() and len(set(table.mass_digest)) == 1
    )  # M of balls does not depend on where they are
    changed = table.mass_digest.copy()
    changed[1] += 1
    heavier = cradle.scene_resolved | {
        "bodies": [
            body | {"mass": np.nextafter(body["mass"], 2.0)}
            for body in cradle.scene_resolved["bodies"]
        ]
    }
    for forged, first in (
        (replace(cradle, impacts=replace(table, mass_digest=changed)), 1),
        (replace(cradle, scene_resolved=heavier), 0),
    ):
        with pytest.raises(IapbError, match=f"impact {first}: M"):
            certify(forged)


def test_digest_is_of_m_made_again_which_in_the_engine_has_the_bits_of_the_step() -> None:
    """On a moving arm the M inside the step of each impact, hashed there, has the digest recorded
    after the run."""
    scene = load_scene(find_scene("three_link_arm_elastic"))
    run = simulate(scene, ImpulseAugmented(), steps=1000)
    simulation = iapb.Simulation(scene)
    inside = []
    for step in range(run.steps):
        simulation.step()
        if step in run.impacts.step:
            inside.append(digests(simulation.state.mass_matrix[None])[0])
    assert inside == run.impacts.mass_digest.tolist() and len(set(inside)) > 1


def test_a_share_that_overflows_does_not_pass() -> None:
    found = certify_impacts(np.diag([1e300, 1.0]), [[1e200, 1.0]], [[-1e200, 1.0]], [[-1e308, 0.0]])
    assert found.momentum == np.inf and not found.passed


def test_a_weak_impact_of_a_fast_body_is_known_up_to_the_rounding_of_its_velocity() -> None:
    """A disc flies along a wall at 1 km/s and meets it at 10 µm/s: v⁺ − v⁻ has eight digits."""
    run = simulate(
        scene_from_text("""name: grazing
rate: 1000
duration: 0.01
contact: {restitution: 1}
bodies:
  - {name: disc, joint: planar, mass: 1, inertia: 1, position: [0.06000000001, 0.08, 0],
     velocity: [799.999994, -600.000008, 0], shapes: [{kind: circle, radius: 0.1}]}
walls: [{name: wall, kind: half_plane, point: [0, 0], normal: [0.6, 0.8]}]
""")
    )
    assert len(run.impacts.step) == 1
    assert certify(run).passed
    wrong = replace(run.impacts, impulse=run.impacts.impulse * (1.0 + 1e-6))
    assert certify(replace(run, impacts=wrong)).momentum > 1e-7
