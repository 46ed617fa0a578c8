"""Distrust: nothing is said of sound runs, and each reason of what is planted in one, or of what
passes through."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iapb.advice.distrust import distrust_of
from iapb.contact.geometry import SPHERE, Shape, make_shapes
from iapb.contact.solids import solids_of
from iapb.run import Run
from iapb.scene.reading import scene_from_values
from iapb.simulation import simulate
from tests.given import data_of, scene_with

GIVEN = data_of(__file__, "distrusted.yaml")
PASSAGES = GIVEN["passages"]
SIDE = 0.1  # of the box that falls


def run_of(name: str, steps: int, **values: Any) -> Run:
    return simulate(scene_with(GIVEN["scenes"][name], **values), steps=steps)


def test_a_run_that_gains_energy_says_so_wherever_it_is_shown() -> None:
    run = run_of("fallen", 200, bodies__box__position=[0, 0.1, 0], contact__stiffness=1e9)
    assert "above start and work" in run.distrust[0]
    assert "not to be trusted" in repr(run)


def test_each_reason_is_found_in_the_arrays_of_a_sound_run() -> None:
    run = run_of("fallen", 200, contact__stiffness=1e4)
    assert run.distrust == distrust_of(run) == () and len(repr(run)) < 160
    rising = np.linspace(0.0, 1.0, 200)
    lost = run.q.copy()
    lost[-1, 0] = np.nan
    excess = {"kinetic": run.energy["kinetic"] + np.append(0.0, rising)}
    for planted, why in (
        (replace(run, energy=run.energy | excess), "above start"),
        (replace(run, energy=run.energy | {"friction_work": rising}), "its energy is"),
        (
            replace(run, contacts=replace(run.contacts, gap=run.contacts.gap - 0.51 * SIDE)),
            "half of 100 mm",
        ),
        (replace(run, q=lost), "not finite"),
    ):
        assert why in distrust_of(planted)[0]


def landed() -> Run:
    """A box whose record is that of a deep landing: it comes in one step, and the overlap fades."""
    run = run_of("fallen", 200, contact__forces="implicit")
    table = run.contacts
    first = int(np.flatnonzero(np.diff(table.offsets))[0])
    since = np.searchsorted(table.offsets, np.arange(len(table.gap)), "right") - 1 - first
    gap = -0.6 * SIDE * 0.97**since
    velocity = np.where(since == 0, gap / run.dt, table.normal_velocity)
    return replace(run, contacts=replace(table, gap=gap, normal_velocity=velocity))


def test_a_deep_landing_is_right_while_its_step_explains_it_and_it_fades() -> None:
    run = landed()
    table = run.contacts
    assert distrust_of(run) == ()
    turned = table.normal.copy()
    deeper = table.gap.copy()
    turned[4:] *= -1.0  # out on the other side
    deeper[4:6] -= 0.03 * SIDE
    for planted in (
        {"is_new": np.zeros_like(table.is_new)},
        {"normal_velocity": 0.9 * table.normal_velocity},  # the step explains a part of it
        {"normal_velocity": -table.normal_velocity},  # it came from the other side
        {"normal": turned},
        {"gap": deeper},
    ):
        said = distrust_of(replace(run, contacts=replace(table, **planted)))
        assert "more than half of 100 mm" in said[0], planted
    (whole,) = distrust_of(replace(run, contacts=replace(table, gap=2.0 * table.gap)))
    assert "all of 100 mm" in whole, "no landing is that deep"
    springs = run.scene_resolved | {"contact": {"forces": "paper", "stiffness": 1e4}}
    assert distrust_of(replace(run, scene_resolved=springs))


def test_a_joint_beyond_its_limit_is_seen() -> None:
    run = run_of("door", 20)
    assert run.distrust == ()
    for beyond, when, seen in (
        (0.009, -1, True),
        (0.007, -1, False),
        (0.101, 5, True),
        (0.099, 5, False),
    ):
        q = run.q.copy()
        q[when, 0] = 0.1 + beyond
        said = "beyond its limits -0.1 and 0.1"
        assert any(said in why for why in distrust_of(replace(run, q=q))) == seen


@pytest.fixture(scope="module")
def thrown() -> Run:
    return run_of("thrown", 100)


def faster(run: Run) -> np.ndarray:
    """The velocities of a run whose first body gains a tenth of its speed, step by step."""
    v = run.v.copy()
    v[:, :3] *= np.linspace(1.0, 1.1, len(v))[:, None]
    return v


@pytest.mark.parametrize("meet", [False, True])
def test_energy_that_a_heavy_neighbour_hides_is_seen(thrown: Run, meet: bool) -> None:
    """If the two touch, one may take energy from the other, but only by forces."""
    table = thrown.contacts
    one = np.zeros(int(meet))
    touching = replace(
        table,
        offsets=table.offsets + np.minimum(np.arange(101), len(one)),
        gap=one,
        body_a=one.astype(int),
        body_b=one.astype(int) + 1,
    )
    assert thrown.distrust == distrust_of(replace(thrown, contacts=touching)) == ()
    energy, speed = distrust_of(replace(thrown, contacts=touching, v=faster(thrown)))
    beyond = "start and the work of all forces" if meet else "start and work"
    assert energy.startswith("the energy of ball is") and f"J above {beyond} at 0.1 s" in energy
    assert speed.startswith("the speed of ball changes by 9.") and speed.endswith(
        "although nothing touches it"
    )


@pytest.mark.parametrize("kind", ["penalty", "friction"])
def test_contact_forces_that_drive_a_body_which_touches_no_other_are_seen(
    thrown: Run, kind: str
) -> None:
    """The work of the forces explains the motion, but no other body gave the energy."""
    v = faster(thrown)
    force = np.zeros_like(thrown.penalty_force)
    force[:, :3] = 0.2 * np.diff(v - thrown.v, axis=0)[:, :3] * 1000.0
    found = distrust_of(replace(thrown, v=v, **{f"{kind}_force": force}))
    assert (
        found[0].startswith("the energy of ball is") and "above start and work at 0.1 s" in found[0]
    )
    assert len(found) == (2 if kind == "friction" else 1) and all(
        "friction drove ball" in why for why in found[1:]
    )


@pytest.mark.parametrize("touched", [False, True])
def test_a_spin_that_turns_while_nothing_touches_the_body_is_seen(
    thrown: Run, touched: bool
) -> None:
    v = thrown.v.copy()
    force = np.zeros_like(thrown.penalty_force)
    angle = np.linspace(0.0, 0.05, len(v))
    # its energy stays
    v[:, 3] = 20.0 * np.sin(angle)
    v[:, 5] = 20.0 * np.cos(angle)
    force[:, 4] = 1e-9 * touched
    found = distrust_of(replace(thrown, v=v, penalty_force=force))
    assert found == (
        () if touched else ("the spin of ball changes by 5 % although nothing touches it",)
    )


def test_a_later_part_of_a_run_continues_its_sums_of_energy(thrown: Run) -> None:
    """What the parts before it gained counts, though its own steps gain nothing."""
    residual = thrown.energy["integration_residual"] + 10.0
    assert distrust_of(replace(thrown, energy=thrown.energy | {"integration_residual": residual}))


def passage(name: str, rule: str) -> Run:
    values = GIVEN["made"] | PASSAGES[name] | {"contact": {"impact_time": rule}}
    return simulate(scene_from_values({k: v for k, v in values.items() if k != "said"}), steps=6)


@pytest.mark.parametrize("name", PASSAGES)
def test_a_body_that_passes_through_another_within_a_step_is_seen(name: str) -> None:
    """None passes where impacts happen at the touch."""
    said = PASSAGES[name].get("said", "")
    found = passage(name, "step").distrust
    assert [why[: len(said)] for why in found] == ([said] if said else [])
    assert not any("passes" in why for why in passage(name, "touch").distrust)


def test_a_wall_that_is_wholly_inside_a_body_is_seen() -> None:
    (found,) = run_of("post", 1).distrust
    assert found == "block and a wall overlap by 5.5 mm at 0 s, all of 4 mm"
    assert not run_of("post", 1, bodies__block__position=[0, 0.0485, 0]).distrust


BALL = [{"kind": "circle", "radius": 0.035}]
WIDE = {"walls__left__center": [-0.305, 0], "walls__right__center": [0.305, 0]}


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"bodies__thing__shapes": BALL}, "10 mm narrower"),
        ({}, "40 mm narrower"),
        ({"contact__friction": 0.5}, ""),  # it holds it there
        (WIDE, ""),
    ],
)
def test_what_falls_through_a_gap_too_narrow_for_it_is_seen(
    values: dict[str, Any], said: str
) -> None:
    run = run_of("gap", 500, **values)
    assert (run.q[-1, 1] < -SIDE) == ("contact__friction" not in values)
    narrow = [why for why in run.distrust if "narrower" in why]
    assert len(narrow) == bool(said) and all(said in why for why in narrow)


def test_a_ball_crosses_a_smaller_one_within_its_own_radius() -> None:
    (small,) = solids_of(make_shapes([Shape(SPHERE, radius=0.005)])).values()
    start = np.array([[0.0, 0.03, 0.1]])
    assert small.crossed(start, start * [1, 1, -1], np.zeros(1), 0.04).all()
