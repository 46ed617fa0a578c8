"""The energy books of scenes: they close, the dampers only take, and what is open falls with the
step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iapb import find_scene, load_scene
from iapb.run import Run
from iapb.simulation import simulate
from reference.worlds import run_world
from verification.scenes import books

SCENES = (
    "wall_1d",
    "peg_corner",
    "arm_pushing",
    "tumbling_body",
    "newton_cradle",
    "peg_hole_space",
)


@pytest.fixture(scope="module")
def runs() -> dict[str, Run]:
    return {name: run_world(load_scene(find_scene(name)), "IAPB") for name in SCENES}


def unaccounted(book: dict[str, float]) -> float:
    """End − start − given + lost − open [J]."""
    given = book["work of the hand"] + book["work of the coupling"]
    lost = book["lost in impacts"] + book["lost in contact damping"] + book["lost in friction"]
    left = book["residual: motion"] + book["residual: springs"]
    return books.total(book, "end") - books.total(book, "start") - given + lost - left


@pytest.mark.parametrize("name", SCENES)
def test_books_close_on_what_they_leave_open(runs: dict[str, Run], name: str) -> None:
    book = books.energy_book(runs[name])
    assert abs(unaccounted(book)) <= 1e-12 * (1 + abs(books.total(book, "start")))


def test_opposite_signs_do_not_cancel(runs: dict[str, Run]) -> None:
    """In the sum with signs, the energy that the springs make up hides most of what the motion
    swallows."""
    book = books.energy_book(runs["peg_hole_space"])
    assert book["residual: motion"] < 0.0 < book["residual: springs"]
    assert books.left_open(book) > 2.0 * abs(book["residual: motion"] + book["residual: springs"])
    assert book[books.OPEN_SHARE] > 1.0


def test_curved_gaps_have_a_line_of_their_own(runs: dict[str, Run]) -> None:
    """A gap along a slide is linear; the corners of the peg move on arcs, which shorter steps
    follow better."""
    assert abs(books.energy_book(runs["wall_1d"])["of the springs' residual, curved gaps"]) < 1e-15
    made = [
        books.energy_book(
            simulate(load_scene(find_scene("peg_corner")).with_values({"rate": rate}))
        )["of the springs' residual, curved gaps"]
        for rate in (512, 4096)
    ]
    assert abs(made[0]) > 4.0 * abs(made[1]) > 0.0


def test_the_step_that_is_short_enough_is_the_one_tried_or_follows_from_the_order() -> None:
    shares = {1: 0.04, 2: 0.02, 4: None}
    assert books.step_for(0.02, 1e-3, shares, 1.0) == 5e-4
    assert books.step_for(0.01, 1e-3, shares, 1.0) == pytest.approx(2.5e-4, rel=1e-12)
    assert books.step_for(0.01, 1e-3, shares, -0.3) is None


def test_a_forgotten_loss_is_seen(runs: dict[str, Run]) -> None:
    run = runs["peg_corner"]
    forgotten = replace(run, energy=run.energy | {"impact_loss": 0.0 * run.energy["impact_loss"]})
    book = books.energy_book(forgotten)
    assert abs(unaccounted(book)) > 0.5 * book["energy exchanged"]


def test_springs_hold_what_the_static_overlap_says(runs: dict[str, Run]) -> None:
    run = runs["wall_1d"]  # at rest at the end: one contact, K s = F
    scene = books.scene_of(run)
    held = books.contact_energy(run, scene)[0][-1]
    assert held == pytest.approx(0.4**2 / (2 * scene.contact.stiffness), rel=1e-3)
    series = books.energy_series(run)
    assert np.all(np.diff(series["lost damping"]) > -1e-6 * series["lost damping"][-1] - 1e-9)


def test_a_contact_that_collides_holds_no_energy_of_a_spring(runs: dict[str, Run]) -> None:
    run = runs["wall_1d"]
    assert (
        len(run.impacts.step)
        and not books.contact_energy(run, books.scene_of(run))[0][run.impacts.step].any()
    )


def test_open_books_fall_with_the_step_and_a_fixed_error_does_not() -> None:
    scene = load_scene(find_scene("tumbling_body")).with_values(
        {"integrator": "semi_implicit_euler"}
    )
    row = books.open_row(scene, lambda refined: simulate(refined, world="IAPB"), (1, 2, 4))
    assert books.is_first_order(row) and row["order measured"] == pytest.approx(1.0, abs=0.1)

    def with_leak(refined: object) -> Run:
        run = simulate(refined, world="IAPB")  # type: ignore[arg-type]
        leak = run.energy["integration_residual"] + 1e-3
        return replace(run, energy=run.energy | {"integration_residual": leak})

    assert not books.is_first_order(books.open_row(scene, with_leak, (1, 2, 4)))
