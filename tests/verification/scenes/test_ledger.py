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
from verification.finding import REFUTED, REPRODUCED
from verification.scenes import books, ledger

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


def unaccounted(book: books.EnergyBook) -> float:
    """End − start − given + lost − left open [J]."""
    given = books.work_given(book.run)[-1]
    left = book.of_motion + book.of_springs
    return float(book.stored[-1] - book.stored[0] - given + sum(book.lost.values()) - left)


@pytest.mark.parametrize("name", SCENES)
def test_books_close_on_what_they_leave_open(runs: dict[str, Run], name: str) -> None:
    book = books.energy_book(runs[name])
    assert abs(unaccounted(book)) <= 1e-12 * (1 + abs(book.stored[0]))


def test_opposite_signs_do_not_cancel(runs: dict[str, Run]) -> None:
    """In the sum with signs, the energy that the springs make up hides most of what the motion
    swallows."""
    book = books.energy_book(runs["peg_hole_space"])
    assert book.of_motion < 0.0 < book.of_springs
    assert book.left_open > 2.0 * abs(book.of_motion + book.of_springs)
    assert book.share(book.left_open) > 0.01


def test_a_forgotten_loss_is_seen(runs: dict[str, Run]) -> None:
    run = runs["peg_corner"]
    forgotten = replace(run, energy=run.energy | {"impact_loss": 0.0 * run.energy["impact_loss"]})
    book = books.energy_book(forgotten)
    assert abs(unaccounted(book)) > 0.5 * book.exchanged


def test_energy_that_a_run_makes_is_seen(runs: dict[str, Run]) -> None:
    run = runs["arm_pushing"]
    assert books.risen(run).max() < 1e-3 * books.energy_book(run).exchanged
    made = np.linspace(0.0, 1.0, run.steps + 1)
    raised = replace(run, energy=run.energy | {"potential": run.energy["potential"] + made})
    assert books.risen(raised).max() > 0.5
    assert books.energy_book(raised).gain > 0.5


def test_springs_hold_what_the_static_overlap_says(runs: dict[str, Run]) -> None:
    run = runs["wall_1d"]  # at rest at the end: one contact, K s = F
    scene = books.scene_of(run)
    book = books.energy_book(run)
    assert book.springs[-1] == pytest.approx(0.4**2 / (2 * scene.contact.stiffness), rel=1e-3)
    lost = -book.damping
    assert np.all(np.diff(lost) > -1e-6 * lost[-1] - 1e-9)


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


def test_a_scene_that_leaves_much_open_misses_its_target() -> None:
    row = {
        "scene": "made up",
        "stopped": "",
        ledger.DEEPEST: 0.1,
        f"{books.OPEN} [%]": 0.5,
        "order measured": 1.0,
    }
    table = ledger.SCENES.table_of([row])
    assert {part.verdict for part in ledger.SCENES.judge(table)} == {REPRODUCED}
    worse = {f"{books.OPEN} [%]": 2.0, "order measured": 0.2, ledger.DEEPEST: 0.9, "stopped": "why"}
    for key, value in worse.items():
        wrong = ledger.SCENES.judge(ledger.SCENES.table_of([row | {key: value}]))
        assert [part.verdict for part in wrong].count(REFUTED) == 1
