"""Distrust: nothing is said of sound runs, and each reason of what is planted in one, or of what
passes through."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iapb.advice.distrust import distrust_of
from iapb.contact.geometry import SPHERE, Shape, make_shapes
from iapb.contact.solids import solids_of
from iapb.run import Run
from iapb.scene import Scene, SpatialScene
from iapb.simulation import simulate

BALL = {"kind": "sphere", "radius": 0.005}
DISC = {"kind": "circle", "radius": 0.005}
SIDE = 0.1
CUBE = {"kind": "box", "size": [0.01] * 3}
SQUARE = {"kind": "box", "size": [0.01] * 2}


def body(
    name: str,
    shape: dict[str, Any],
    position: list[float],
    velocity: list[float],
    mass: float = 0.2,
) -> Any:
    flat = len(position) == 2
    return {
        "name": name,
        "joint": "planar" if flat else "free_flyer",
        "mass": mass,
        "inertia": 1e-5 if flat else [1e-5, 1e-5, 1e-5],
        "shapes": [shape],
        "position": [*position, 0] if flat else [*position, 0, 0, 0, 1],
        "velocity": [*velocity, *[0.0] * ((3 if flat else 6) - len(velocity))],
    }


def run_of(*bodies: Any, walls: Any = (), steps: int = 6, **given: Any) -> Run:
    kind, more = (
        (Scene, {})
        if isinstance(bodies[0]["inertia"], float)
        else (SpatialScene, {"dimensions": 3})
    )
    scene = {
        "name": "made",
        "rate": 1000.0,
        "duration": 1.0,
        "bodies": list(bodies),
        "walls": list(walls),
    }
    return simulate(kind.model_validate(scene | more | given), steps=steps)


def fallen(height: float = 0.01, **values: Any) -> Run:
    """A box that falls on a floor, with a larger one on top."""
    shape = {"kind": "box", "size": [SIDE, SIDE]}
    roof = {"kind": "box", "size": [3 * SIDE, 3 * SIDE], "center": [0, 2 * SIDE]}
    crate = body("box", shape, [0, 0.5 * SIDE + height], [], mass=1.0)
    crate |= {"inertia": SIDE**2 / 6.0, "shapes": [shape, roof]}
    floor = {"name": "floor", "kind": "half_plane", "point": [0, 0], "normal": [0, 1]}
    return run_of(
        crate, walls=[floor], steps=200, gravity=[0, -9.81], contact={"forces": "paper"} | values
    )


def test_a_run_that_gains_energy_says_so_wherever_it_is_shown() -> None:
    run = fallen(0.05, stiffness=1e9)
    assert "above start and work" in run.distrust[0]
    assert "not to be trusted" in repr(run)


def test_each_reason_is_found_in_the_arrays_of_a_sound_run() -> None:
    run = fallen(stiffness=1e4)
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
    run = fallen(forces="implicit")
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
    door = body("door", SQUARE, [0, 0], []) | {
        "joint": "prismatic",
        "axis": [1, 0],
        "position": [0.0],
        "velocity": [0.0],
        "joint_limits": [-0.1, 0.1],
        "inertia": 1.0,
    }
    run = run_of(door, steps=20)
    for beyond, when, seen in (
        (0.009, -1, True),
        (0.007, -1, False),
        (0.101, 5, True),
        (0.099, 5, False),
    ):
        q = run.q.copy()
        q[when, 0] = 0.1 + beyond
        assert (
            run.distrust == ()
            and any(
                "beyond its limits -0.1 and 0.1" in why for why in distrust_of(replace(run, q=q))
            )
            == seen
        )


@pytest.fixture(scope="module")
def thrown() -> Run:
    """A light ball that turns in the air, and a heavy crate that falls beside it."""
    ball = body("ball", BALL, [0, 0, 0], [0.3, 0, 0, 0, 0, 20.0])
    crate = body("crate", {"kind": "box", "size": [0.3] * 3}, [0, 2, 0], [], mass=40.0)
    return run_of(ball, crate, steps=100, gravity=[0, 0, -9.81])


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


def plate(*size: float, center: Any = None, **values: Any) -> list[dict[str, Any]]:
    return [
        {
            "name": "plate",
            "kind": "box",
            "size": size,
            "center": center or [0] * len(size),
            **values,
        }
    ]


UP = [0, 0.1]
HIGH = [0, 0.105]
DOWN = [0, -30.0]
PASSAGES: dict[str, tuple[list[Any], list[Any], str]] = {
    "box, plate": ([body("a", SQUARE, HIGH, DOWN)], plate(0.2, 0.01), "a passes through plate"),
    "beside it": ([body("a", SQUARE, UP, DOWN)], plate(0.2, 0.01, center=[0.106, 0]), ""),
    "past its corner": ([body("a", DISC, [0.156, 0.041], [-31.0, -31.0])], plate(0.2, 0.01), ""),
    "box, plate in space": (
        [body("a", CUBE, [0, 0, 0.105], [0, 0, -30.0])],
        plate(0.2, 0.2, 0.01),
        "a passes through plate",
    ),
    "disc, moving plate": (
        [
            body("a", DISC, UP, [0, -21.0]),
            body("b", {"kind": "box", "size": [0.2, 0.004]}, [0, -0.1], [0, 22.0]),
        ],
        [],
        "a passes through b",
    ),
    "balls": (
        [body("a", BALL, [-0.1, 0, 0], [30, 0, 0]), body("b", BALL, [0.1, 0.004, 0], [-30, 0, 0])],
        [],
        "a passes through b",
    ),
    "balls that miss": (
        [body("a", BALL, [-0.1, 0, 0], [30, 0, 0]), body("b", BALL, [0.1, 0.0101, 0], [-30, 0, 0])],
        [],
        "",
    ),
    "turning plate that misses": (
        [
            body("a", {"kind": "box", "size": [0.2, 0.004]}, [0, 0], [0, 0, 900.0]),
            body("b", DISC, [0, 0.106], [1.0, 0]),
        ],
        [],
        "",
    ),
}


# a ball 10 mm beside its body, 40 mm in a step, through a turned plate or past its end
TILTED = {"name": "plate", "kind": "box", "center": [0.3, 0.2], "angle": -2.0, "size": [0.2, 0.004]}
c = math.cos(-2.0)
s = math.sin(-2.0)
for along, said in ((0.05, "ball passes through plate in the step to 0.003 s"), (0.12, "")):
    start = [0.3 + c * along - s * 0.1 - 0.01, 0.2 + s * along + c * 0.1]
    ball = body("ball", DISC | {"center": [0.01, 0]}, start, [40.0 * s, -40.0 * c])
    PASSAGES[f"ball, turned plate, {along} from its middle"] = ([ball], [TILTED], said)
PASSAGES["upside down in space"] = (
    [
        body("ball", BALL | {"center": [0, 0, 0.03]}, [0, 0, 0], [0, 0, 40.0])
        | {"position": [0, 0, 0.13, 1, 0, 0, 0]}
    ],
    plate(0.2, 0.2, 0.004, rpy=[0.2, 0.1, 0.3]),
    "ball passes through plate",
)


@pytest.mark.parametrize("name", PASSAGES)
def test_a_body_that_passes_through_another_within_a_step_is_seen(name: str) -> None:
    bodies, walls, said = PASSAGES[name]
    found = run_of(*bodies, walls=walls, contact={"impact_time": "step"}).distrust
    assert [why[: len(said)] for why in found] == ([said] if said else [])


@pytest.mark.parametrize("name", PASSAGES)
def test_none_passes_where_impacts_happen_at_the_touch(name: str) -> None:
    bodies, walls, _ = PASSAGES[name]
    assert not any("passes" in why for why in run_of(*bodies, walls=walls).distrust)


def test_a_wall_that_is_wholly_inside_a_body_is_seen() -> None:
    post = {"name": "post", "kind": "circle", "radius": 0.002}
    block = body("block", {"kind": "box", "size": [0.1, 0.1]}, [0, 0.0465], [])
    (found,) = run_of(block, walls=[post], steps=1).distrust
    assert found == "block and a wall overlap by 5.5 mm at 0 s, all of 4 mm"
    assert (
        run_of(body("block", block["shapes"][0], [0, 0.0485], []), walls=[post], steps=1).distrust
        == ()
    )


@pytest.mark.parametrize(
    ("shape", "wide", "friction", "said"),
    [
        ({"kind": "circle", "radius": 0.035}, 0.06, 0.0, "10 mm narrower"),
        ({"kind": "box", "size": [SIDE, SIDE]}, 0.06, 0.0, "40 mm narrower"),
        ({"kind": "box", "size": [SIDE, SIDE]}, 0.06, 0.5, ""),  # friction holds it there
        ({"kind": "box", "size": [SIDE, SIDE]}, 0.11, 0.0, ""),
    ],
)
def test_what_falls_through_a_gap_too_narrow_for_it_is_seen(
    shape: dict[str, Any], wide: float, friction: float, said: str
) -> None:
    walls = [
        {
            "name": name,
            "kind": "box",
            "size": [0.5, 1.0],
            "center": [side * (0.25 + 0.5 * wide), 0.0],
        }
        for name, side in (("left", -1.0), ("right", 1.0))
    ]
    thing = body("thing", shape, [0, 0], [], mass=1.0) | {"inertia": SIDE**2 / 6.0}
    run = run_of(
        thing,
        walls=walls,
        steps=500,
        gravity=[0, -9.81],
        contact={
            "forces": "paper",
            "stiffness": 1e4,
            "damping": 50.0,
            "friction": friction,
            "friction_velocity": 0.3,
        },
    )
    assert (run.q[-1, 1] < -SIDE) == (friction == 0.0)
    assert [why for why in run.distrust if "narrower" in why and said not in why] == []
    assert any("narrower" in why for why in run.distrust) == bool(said)


def test_a_ball_crosses_a_smaller_one_within_its_own_radius() -> None:
    (small,) = solids_of(make_shapes([Shape(SPHERE, radius=0.005)], True)).values()
    start = np.array([[0.0, 0.03, 0.1]])
    assert small.crossed(start, start * [1, 1, -1], np.zeros(1), 0.04).all()
