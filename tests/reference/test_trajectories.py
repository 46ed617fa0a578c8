"""Trajectories: exact events by hand and by energy; time stepping against them and against another's file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from iapb.errors import ArgumentError
from reference.complementarity import ImpactProblem
from reference.complementarity.laws import Outcome, poisson
from reference.event_driven import LinearSystem, event_driven
from reference.rigid_step import nearest_velocity, rigid_step

PROBLEMS = Path(__file__).parents[3] / "shared" / "problems"


def ball(e: float, mass: float = 1.0) -> LinearSystem:
    return LinearSystem([[mass]], [-9.81 * mass], [[1.0]], [0.0], e)


def row_of_balls(masses: list[float], e: float) -> LinearSystem:
    """Balls on a line, coordinates left to right, radius absorbed."""
    n = len(masses)
    return LinearSystem(np.diag(masses), np.zeros(n), np.diff(np.eye(n), axis=0), np.zeros(n - 1), e)


class Stepped(NamedTuple):
    """States at n + 1 instants: time (n+1,), q and v (n+1, d); impulse (n+1, c) of the step ending there."""

    time: np.ndarray
    q: np.ndarray
    v: np.ndarray
    impulse: np.ndarray


def moreau_jean(system: LinearSystem, q: list[float], v: list[float], dt: float, steps: int) -> Stepped:
    """Moreau-Jean's scheme with theta = 1/2 (Jean, Comput. Methods Appl. Mech. Eng. 177, 1999)."""
    states = [(0.0, np.array(q), np.array(v), np.zeros(len(system.start)))]
    for k in range(steps):
        _, at, moving, _ = states[-1]
        gamma = system.rows @ moving
        bound = np.where(system.gap(at) + 0.5 * dt * gamma <= 0.0, -system.restitution * gamma, -np.inf)
        free = moving + dt * np.linalg.solve(system.mass_matrix, system.force)
        found = nearest_velocity(system.mass_matrix, free, system.rows, bound)
        states.append(((k + 1) * dt, at + 0.5 * dt * (found.velocity + moving), found.velocity, found.impulse))
    return Stepped(*(np.array(part) for part in zip(*states, strict=True)))


def test_ball_bounces_at_the_times_of_the_textbook() -> None:
    e, height, g = 0.8, 1.0, 9.81
    exact = event_driven(ball(e), [height], [0.0], 2.0)
    fall = np.sqrt(2.0 * height / g)
    expected = fall * np.array([0.0, 1.0, 1.0 + 2.0 * e, 1.0 + 2.0 * e + 2.0 * e**2])
    assert exact.event_time[:4] == pytest.approx(expected, rel=1e-14)
    assert exact.v[1, 0] == pytest.approx(e * g * fall, rel=1e-14)


def test_accumulating_impacts_are_reported_not_crossed() -> None:
    """Beyond fall (1 + e)/(1 − e) the ball rests; the trajectory ends before and says where."""
    exact = event_driven(ball(0.5), [1.0], [0.0], 10.0, most_events=30)
    limit = np.sqrt(2.0 / 9.81) * 1.5 / 0.5
    assert exact.end <= limit and exact.end == pytest.approx(limit, rel=1e-6)
    with pytest.raises(ArgumentError, match="times in"):
        exact.state([5.0])


def test_plastic_block_slides_into_the_corner_and_rests() -> None:
    """A block pushed right and down: floor, then wall, then still; each wall's impulse is the lost momentum."""
    rows, start = [[0.0, 1.0], [-1.0, 0.0]], [0.0, 1.0]
    system = LinearSystem(2.0 * np.eye(2), [1.0, -4.0], rows, start, 0.0)
    exact = event_driven(system, [0.0, 0.25], [0.0, 0.0], 5.0)
    assert exact.event_time == pytest.approx([0.0, 0.5, 2.0], rel=1e-14)
    assert exact.impulse[1] == pytest.approx([2.0, 0.0]) and exact.impulse[2] == pytest.approx([0.0, 2.0])
    q, v = exact.state([5.0])
    assert q[0] == pytest.approx([1.0, 0.0], abs=1e-14) and np.abs(v).max() <= 1e-14


def test_a_resting_contact_opens_when_the_force_lifts_it_and_equal_elastic_balls_exchange_their_velocities() -> None:
    lifted = LinearSystem([[1.0]], [1.0], [[1.0]], [0.0], 0.0)
    assert event_driven(lifted, [0.0], [0.0], 2.0).state([2.0])[0][0, 0] == pytest.approx(2.0)
    exact = event_driven(row_of_balls([1.0, 1.0, 1.0], 1.0), [0.0, 1.0, 2.5], [1.0, 0.0, 0.0], 10.0)
    assert exact.v[-1] == pytest.approx([0.0, 0.0, 1.0], abs=1e-14)


@pytest.mark.skipif(not (PROBLEMS / "trajectories").exists(), reason="shared problem files are not here")
def test_moreau_ball_reproduces_the_siconos_reference() -> None:
    reference = np.loadtxt(PROBLEMS / "trajectories" / "BouncingBallTS.ref", skiprows=1)
    stepped = moreau_jean(ball(0.9), [1.0], [0.0], 0.005, len(reference) - 1)
    ours = np.column_stack([stepped.time, stepped.q, stepped.v, stepped.impulse])
    assert np.abs(ours - reference[:, :4]).max() <= 1e-12
    assert np.abs(stepped.impulse[:, 0] - reference[:, 4]).max() <= 1e-12


def moreau(system: LinearSystem, q: list[float], v: list[float], dt: float, steps: int):  # type: ignore[no-untyped-def]
    stepped = moreau_jean(system, q, v, dt, steps)
    return stepped.q, stepped.v


def anitescu(system: LinearSystem, q: list[float], v: list[float], dt: float, steps: int):  # type: ignore[no-untyped-def]
    states = [(np.array(q), np.array(v))]
    for _ in range(steps):
        at, moving = states[-1]
        moved = rigid_step(system.mass_matrix, moving, system.force, dt, system.rows, system.gap(at),
                           system.rows @ moving, system.restitution).velocity  # fmt: skip
        states.append((at + dt * moved, moved))
    return tuple(np.array(part) for part in zip(*states, strict=True))


SCENES = {
    "ball, e = 0.8": (ball(0.8), [1.0], [0.0], 1.3),
    "ball, plastic": (ball(0.0), [1.0], [0.0], 0.8),
    "block in a corner": (
        LinearSystem(2.0 * np.eye(2), [1.0, -4.0], [[0.0, 1.0], [-1.0, 0.0]], [0.0, 1.0], 0.0),
        [0.0, 0.25], [0.0, 0.0], 3.0,
    ),
    "cradle": (row_of_balls([1.0, 2.0, 1.0], 0.6), [0.0, 0.51, 1.23], [1.0, 0.0, -0.3], 2.0),
}  # fmt: skip


COARSE, FINE = (97, 130, 200, 231, 310), (1603, 2010, 2777, 3200, 4099)  # impacts fall anywhere in a step


def error_per_step(scene: str, method: Callable, counts: tuple[int, ...]) -> np.ndarray:  # type: ignore[type-arg]
    """Largest error divided by the step, over step counts: positions in the sup norm, velocities in L1."""
    system, q, v, duration = SCENES[scene]
    exact = event_driven(system, q, v, duration)
    found = []
    for n in counts:
        dt = duration / n
        stepped_q, stepped_v = method(system, q, v, dt, n)
        true_q, true_v = exact.state(np.minimum(dt * np.arange(n + 1), exact.end))
        found.append([np.abs(stepped_q - true_q).max() / dt, np.abs(stepped_v - true_v).sum(axis=0).max()])
    return np.max(found, axis=0)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("method", [moreau, anitescu])
def test_time_stepping_converges_at_first_order(scene: str, method: Callable) -> None:  # type: ignore[type-arg]
    """The worst error divided by the step stays the same from some 200 to some 3000 steps (a factor 16)."""
    coarse, fine = (error_per_step(scene, method, counts) for counts in (COARSE, FINE))
    assert (fine <= 1.5 * coarse + 1e-9).all(), (coarse, fine)


def test_the_order_check_sees_a_wrong_law() -> None:
    """A law with the wrong restitution has an error that the step does not shrink."""

    def wrong(system: LinearSystem, *start: Any) -> Any:
        return moreau(replace(system, restitution=0.7), *start)

    coarse, fine = (error_per_step("ball, e = 0.8", wrong, counts) for counts in (COARSE, FINE))
    assert (fine > 5.0 * coarse).all()


def test_the_law_of_the_impacts_is_the_callers() -> None:
    def plastic(problem: ImpactProblem) -> Outcome:
        return poisson(replace(problem, restitution=np.zeros(problem.contacts)))

    system = row_of_balls([1.0, 1.0], 1.0)
    assert event_driven(system, [0.0, 1.0], [1.0, 0.0], 3.0).v[-1] == pytest.approx([0.0, 1.0])
    assert event_driven(system, [0.0, 1.0], [1.0, 0.0], 3.0, law=plastic).v[-1] == pytest.approx([0.5, 0.5])
