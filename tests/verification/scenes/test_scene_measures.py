"""The energy books of scenes: they close, the dampers only take, and what is open falls with the step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb import find_scene, load_scene
from iapb.run import Run
from iapb.simulation import simulate
from verification.scenes.contact_energy import contact_energy
from verification.scenes.open_books import is_rounding, left_open, measured_order, open_books
from verification.scenes.scene_measures import MOVES, SETTLES, energy_book, energy_series, measure, scene_of

SCENES = ("wall_1d", "peg_corner", "arm_pushing", "tumbling_body", "newton_cradle", "peg_hole_space")


@pytest.fixture(scope="module")
def runs() -> dict[str, Run]:
    return {name: simulate(load_scene(find_scene(name)), world="IAPB") for name in SCENES}


@pytest.mark.parametrize("name", SCENES)
def test_books_close_on_what_they_leave_open(runs: dict[str, Run], name: str) -> None:
    book = energy_book(runs[name])
    given, lost = book.hand + book.coupling, book.lost_impacts + book.lost_damping + book.lost_friction
    assert book.end - book.start == pytest.approx(given - lost + book.unexplained, abs=1e-12 * (1 + abs(book.start)))
    assert book.unexplained == pytest.approx(book.from_motion + book.from_springs, abs=1e-15)


def test_a_forgotten_loss_is_seen(runs: dict[str, Run]) -> None:
    run = runs["peg_corner"]
    forgotten = replace(run, energy=run.energy | {"impact_loss": 0.0 * run.energy["impact_loss"]})
    book = energy_book(forgotten)
    given, lost = book.hand + book.coupling, book.lost_impacts + book.lost_damping + book.lost_friction
    assert abs(book.end - book.start - given + lost - book.unexplained) > 0.5 * book.turned_over


def test_springs_hold_what_the_static_overlap_says(runs: dict[str, Run]) -> None:
    run = runs["wall_1d"]  # at rest at the end: one contact, K s = F
    scene = scene_of(run)
    held = contact_energy(run, scene).springs[-1]
    assert held == pytest.approx(0.4**2 / (2 * scene.contact.stiffness), rel=1e-3)
    series = energy_series(run)
    assert np.all(np.diff(series.lost_damping) > -1e-6 * series.lost_damping[-1] - 1e-9)


def test_dampers_are_nothing_without_damping(runs: dict[str, Run]) -> None:
    assert not np.any(contact_energy(runs["newton_cradle"], scene_of(runs["newton_cradle"])).damping_work)


def test_endings_and_counts(runs: dict[str, Run]) -> None:
    found = {name: measure(run) for name, run in runs.items()}
    assert found["peg_corner"].ending == SETTLES and found["tumbling_body"].ending == MOVES
    assert found["peg_hole_space"].dimensions == 3 and found["peg_corner"].dimensions == 2
    assert found["peg_hole_space"].most_rows >= 20  # tens of simultaneous collisions
    assert found["tumbling_body"].penetration == 0.0 < found["peg_corner"].penetration


def test_open_books_fall_with_the_declared_order_and_a_fixed_error_does_not() -> None:
    scene = load_scene(find_scene("tumbling_body"))
    books = open_books(scene, lambda refined: simulate(refined, world="IAPB"))
    assert books.falls_as_declared and books.order == pytest.approx(1.0, abs=0.1)

    def with_leak(refined: object) -> Run:
        run = simulate(refined, world="IAPB")  # type: ignore[arg-type]
        leak = run.energy["integration_residual"] + 1e-3
        return replace(run, energy=run.energy | {"integration_residual": leak})

    assert not open_books(scene, with_leak).falls_as_declared


def test_rounding_is_no_order(runs: dict[str, Run]) -> None:
    assert is_rounding(energy_book(runs["newton_cradle"]))
    assert not is_rounding(energy_book(runs["peg_corner"])) and left_open(energy_book(runs["peg_corner"])) > 0.0
    assert measured_order(4.0, 1.0, 4.0) == 1.0
