"""Distrust by tree, by spin and by passage: faults planted in sound records, and bodies that pass within a step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iapb.advice.distrust import distrust_of
from iapb.run import Run
from iapb.scene import Scene, SpatialScene
from iapb.simulation import simulate

BALL = {"kind": "sphere", "radius": 0.005}
DISC = {"kind": "circle", "radius": 0.005}
CUBE, SQUARE = {"kind": "box", "size": [0.01] * 3}, {"kind": "box", "size": [0.01] * 2}


def body(name: str, shape: dict[str, Any], position: list[float], velocity: list[float], mass: float = 0.2) -> Any:
    flat = len(position) == 2
    return {"name": name, "joint": "planar" if flat else "free_flyer", "mass": mass,
            "inertia": 1e-5 if flat else [1e-5, 1e-5, 1e-5], "shapes": [shape],
            "position": [*position, 0] if flat else [*position, 0, 0, 0, 1],
            "velocity": [*velocity, *[0.0] * ((3 if flat else 6) - len(velocity))]}


def run_of(*bodies: Any, walls: Any = (), steps: int = 6, **given: Any) -> Run:
    kind, more = (Scene, {}) if bodies[0]["joint"] == "planar" else (SpatialScene, {"dimensions": 3})
    scene = {"name": "made", "rate": 1000.0, "duration": 1.0, "bodies": list(bodies), "walls": list(walls)}
    return simulate(kind.model_validate(scene | more | given), steps=steps)


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
    table, one = thrown.contacts, np.zeros(int(meet))
    touching = replace(table, offsets=table.offsets + np.minimum(np.arange(101), len(one)), gap=one,
                       body_a=one.astype(int), body_b=one.astype(int) + 1)
    assert thrown.distrust == distrust_of(replace(thrown, contacts=touching)) == ()
    energy, speed = distrust_of(replace(thrown, contacts=touching, v=faster(thrown)))
    beyond = "start and the work of all forces" if meet else "start and work"
    assert energy.startswith("the energy of ball is") and f"J above {beyond} at 0.1 s" in energy
    assert speed.startswith("the speed of ball changes by 9.") and speed.endswith("although nothing touches it")


@pytest.mark.parametrize("kind", ["penalty", "friction"])
def test_contact_forces_that_drive_a_body_which_touches_no_other_are_seen(thrown: Run, kind: str) -> None:
    """The work of the forces explains the motion, but no other body gave the energy."""
    v, force = faster(thrown), np.zeros_like(thrown.penalty_force)
    force[:, :3] = 0.2 * np.diff(v - thrown.v, axis=0)[:, :3] * 1000.0
    found = distrust_of(replace(thrown, v=v, **{f"{kind}_force": force}))
    assert found[0].startswith("the energy of ball is") and "above start and work at 0.1 s" in found[0]
    assert len(found) == (2 if kind == "friction" else 1) and all("friction drove ball" in why for why in found[1:])


@pytest.mark.parametrize("touched", [False, True])
def test_a_spin_that_turns_while_nothing_touches_the_body_is_seen(thrown: Run, touched: bool) -> None:
    v, force = thrown.v.copy(), np.zeros_like(thrown.penalty_force)
    angle = np.linspace(0.0, 0.05, len(v))
    v[:, 3], v[:, 5] = 20.0 * np.sin(angle), 20.0 * np.cos(angle)  # its energy stays
    force[:, 4] = 1e-9 * touched
    found = distrust_of(replace(thrown, v=v, penalty_force=force))
    assert found == (() if touched else ("the spin of ball changes by 5 % although nothing touches it",))


def test_a_later_part_of_a_run_is_followed_from_its_second_state_on(thrown: Run) -> None:
    q, v = thrown.q.copy(), thrown.v.copy()
    q[0, 2], v[0, :6] = 1.0, 0.0  # the start of the whole run
    part = replace(thrown, q=q, v=v, time=thrown.time + 1.0)
    assert distrust_of(part) == () != distrust_of(replace(part, time=thrown.time))


def plate(*size: float, center: Any = None, **values: Any) -> list[dict[str, Any]]:
    return [{"name": "plate", "kind": "box", "size": size, "center": center or [0] * len(size), **values}]


UP, DOWN = [0, 0.1], [0, -30.0]
PASSAGES: dict[str, tuple[list[Any], list[Any], str]] = {
    "box, plate": ([body("a", SQUARE, UP, DOWN)], plate(0.2, 0.01), "a passes through plate"),
    "beside it": ([body("a", SQUARE, UP, DOWN)], plate(0.2, 0.01, center=[0.106, 0]), ""),
    "past its corner": ([body("a", DISC, [0.156, 0.041], [-31.0, -31.0])], plate(0.2, 0.01), ""),
    "box, plate in space": ([body("a", CUBE, [0, 0, 0.1], [0, 0, -30.0])], plate(0.2, 0.2, 0.01),
                            "a passes through plate"),
    "polygon, polygon": (
        [body("a", {"kind": "polygon", "vertices": [[0, 0], [0.01, 0], [0, 0.01]]}, UP, DOWN)],
        [{"name": "plate", "kind": "polygon", "vertices": [[-0.1, -0.005], [0.1, -0.005], [0, 0.005]]}],
        "a passes through plate"),
    "ends of two plates": ([body("a", {"kind": "box", "size": [0.1, 0.01]}, UP, DOWN)],
                           plate(0.1, 0.01, center=[0.09, 0]), "a passes through plate"),
    "box, round post": ([body("a", {"kind": "box", "size": [0.02, 0.02]}, [0.004, 0.1], [0, -60.0])],
                        [{"name": "post", "kind": "circle", "radius": 0.004}], "a passes through post"),
    "box, ball that stands": ([body("a", CUBE, [0.002, 0.002, 0.1], [0, 0, -40.0])],
                              [{"name": "knob", "kind": "sphere", "radius": 0.004}], "a passes through knob"),
    "disc, moving plate": ([body("a", DISC, UP, [0, -21.0]),
                            body("b", {"kind": "box", "size": [0.2, 0.004]}, [0, -0.1], [0, 22.0])], [],
                           "a passes through b"),
    "balls": ([body("a", BALL, [-0.1, 0, 0], [30, 0, 0]), body("b", BALL, [0.1, 0.004, 0], [-30, 0, 0])], [],
              "a passes through b"),
    "balls that miss": ([body("a", BALL, [-0.1, 0, 0], [30, 0, 0]), body("b", BALL, [0.1, 0.0101, 0], [-30, 0, 0])],
                        [], ""),
    "turning plate that misses": ([body("a", {"kind": "box", "size": [0.2, 0.004]}, [0, 0], [0, 0, 900.0]),
                                   body("b", DISC, [0, 0.106], [1.0, 0])], [], ""),
}


@pytest.mark.parametrize("name", PASSAGES)
def test_a_body_that_passes_through_another_within_a_step_is_seen(name: str) -> None:
    bodies, walls, said = PASSAGES[name]
    found = run_of(*bodies, walls=walls).distrust
    assert [why[: len(said)] for why in found] == ([said] if said else [])


def test_a_wall_that_is_wholly_inside_a_body_is_seen() -> None:
    post = {"name": "post", "kind": "circle", "radius": 0.002}
    block = body("block", {"kind": "box", "size": [0.1, 0.1]}, [0, 0.0465], [])
    (found,) = run_of(block, walls=[post], steps=1).distrust
    assert found == "block and a wall overlap by 5.5 mm at 0 s, all of 4 mm"
    assert run_of(body("block", block["shapes"][0], [0, 0.0485], []), walls=[post], steps=1).distrust == ()
