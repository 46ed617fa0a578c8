"""Friction: a mass on a plane by hand, and the two cone solvers against each other and their residuals."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from reference.complementarity import SOLVERS, ImpactProblem, Solution, solve, solver_names
from reference.complementarity.solution import project_on_cone
from reference.datasets import read_problem
from reference.one_thread import one_thread

PROBLEMS = Path(__file__).parents[4] / "shared" / "problems"

CONE_SOLVERS = ("nsgs", "newton_cones", "cvxpy_socp", "pinocchio_pgs", "pinocchio_admm")
JOINT_SOLVERS = ("nsgs", "newton_cones", "cvxpy_socp")


def mass_on_a_plane(v: list[float], mu: float, relaxed: bool = False) -> ImpactProblem:
    """A point mass of 2 kg; the contact's frame is (normal, two tangents)."""
    return ImpactProblem.from_impact(2.0 * np.eye(3), np.eye(3), v, 0.0, mu, relaxed=relaxed)


@pytest.mark.parametrize("solver", CONE_SOLVERS)
def test_a_mass_sticks_or_slides_as_coulomb_says(solver: str) -> None:
    sticks = solve(mass_on_a_plane([-1.0, 0.2, 0.1], 0.5), solver)
    slides = solve(mass_on_a_plane([-1.0, 3.0, 4.0], 0.5), solver)
    assert sticks.solved(1e-8) and np.abs(sticks.velocity_plus).max() <= 1e-8
    # the friction impulse 0.5 · 2 N s takes 0.5 m/s off the 5 m/s of sliding, along its direction
    assert slides.solved(1e-7)
    assert slides.velocity_plus == pytest.approx([0.0, 2.7, 3.6], abs=1e-6)


RELAXED_SOLVERS = ("nsgs", "newton_cones", "cvxpy_socp", "pinocchio_admm")


@pytest.mark.parametrize("solver", RELAXED_SOLVERS)
def test_the_relaxed_law_lifts_off_where_it_slides(solver: str) -> None:
    """What the convex relaxation costs: sliding bodies separate with mu times their sliding speed."""
    solution = solve(mass_on_a_plane([-1.0, 3.0, 4.0], 0.5, relaxed=True), solver)
    v = solution.velocity_plus
    assert solution.solved(1e-7)
    assert v[0] == pytest.approx(0.5 * np.hypot(v[1], v[2]), rel=1e-6) and v[0] > 0.1


@pytest.mark.parametrize("relaxed", [True, False])
def test_solvers_agree_on_random_problems(relaxed: bool) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        root, rows = rng.normal(size=(6, 6)), rng.normal(size=(3 * int(rng.integers(1, 4)), 6))
        problem = ImpactProblem.from_impact(root @ root.T + np.eye(6), rows, rng.normal(size=6), 0.2, 0.3,
                                            relaxed=relaxed)  # fmt: skip
        solutions = [solve(problem, name) for name in (RELAXED_SOLVERS if relaxed else CONE_SOLVERS)]
        for solution in solutions:
            assert solution.solved(1e-5), (seed, solution.solver, solution.note, solution.residuals)
            if relaxed:  # convex: one velocity; Coulomb's law may have several
                assert np.abs(solution.velocity_plus - solutions[0].velocity_plus).max() <= 1e-5


def test_kinds_of_problems_are_refused_by_solvers_of_the_other_kind() -> None:
    here = solver_names(mass_on_a_plane([1.0, 0.0, 0.0], 0.5))
    assert tuple(name for name in here if SOLVERS[name].package != "siconos") == CONE_SOLVERS
    assert solve(mass_on_a_plane([-1.0, 0.0, 0.0], 0.5), "daqp").verdict() == "refused"
    assert solve(mass_on_a_plane([-1.0, 1.0, 0.0], 0.5, relaxed=True), "pinocchio_pgs").verdict() == "refused"
    assert solve(ImpactProblem.from_delassus([[1.0]], [-1.0]), "nsgs").verdict() == "refused"


@hypothesis_settings(max_examples=50)
@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3), st.floats(0.0, 2.0))
def test_projection_obeys_moreau(x: list[float], mu: float) -> None:
    """x = proj_K(x) − proj_K*(−x), the two parts orthogonal, each in its cone."""
    point, friction = np.array([x]), np.array([mu])
    inside = project_on_cone(point, friction)
    rest = inside - point  # lies in the dual cone
    assert np.abs(project_on_cone(inside, friction) - inside).max() <= 1e-12
    assert abs((inside * rest).sum()) <= 1e-12
    assert rest[0, 0] >= mu * np.linalg.norm(rest[0, 1:]) - 1e-12


# --- joints beside contacts with friction (mixed problems) ---------------------------------------------------------
def welded_masses(v: list[list[float]], e: float, mu: float, planar: bool = True) -> ImpactProblem:
    """Masses of 1 and 2 kg, welded to one another; the second strikes the floor. Frames (normal, tangents)."""
    d = 2 if planar else 3
    joint, floor = np.hstack([np.eye(d), -np.eye(d)]), np.hstack([np.zeros((d, d)), np.eye(d)])
    mass = np.diag([1.0] * d + [2.0] * d)
    velocity = np.array(v)[:, :d].ravel()
    return ImpactProblem.from_impact(mass, np.vstack([joint, floor]), velocity, e, mu, contact_size=d,
                                     bilateral=[True, False])  # fmt: skip


@pytest.mark.parametrize("solver", JOINT_SOLVERS)
@pytest.mark.parametrize("planar", [True, False])
def test_joints_and_friction_by_hand(solver: str, planar: bool) -> None:
    """The weld makes 3 kg with (−1/3, 1, 0) m/s of (−1, 3, 0) and none: p_n = 1 N s, and friction takes at most μ."""
    struck = [[-1.0, 3.0, 0.0], [0.0, 0.0, 0.0]]
    slides = solve(welded_masses(struck, 0.0, 0.5, planar), solver)
    sticks = solve(welded_masses(struck, 0.0, 4.0, planar), solver)
    d = 2 if planar else 3
    assert slides.solved(1e-8), (slides.note, slides.residuals)
    assert slides.velocity_plus.reshape(2, d)[:, :2] == pytest.approx(np.array([[0.0, 5 / 6]] * 2), abs=1e-8)
    assert slides.answer().reshape(2, d)[:, :2] == pytest.approx(np.array([[1.0, -13 / 6], [1.0, -0.5]]), abs=1e-7)
    assert sticks.solved(1e-8) and np.abs(sticks.velocity_plus).max() <= 1e-8
    assert sticks.answer().reshape(2, d)[:, :2] == pytest.approx(np.array([[1.0, -3.0], [1.0, -3.0]]), abs=1e-7)


@pytest.mark.parametrize("solver", JOINT_SOLVERS)
def test_contacts_bounce_and_joints_do_not(solver: str) -> None:
    """Both fall at 1 m/s, e = 1/2: both rise with 1/2; the weld carries 3/2 N s for the mass above."""
    falls = solve(welded_masses([[-1.0, 0.0], [-1.0, 0.0]], 0.5, 0.3), solver)
    assert falls.solved(1e-8)
    assert falls.velocity_plus == pytest.approx([0.5, 0.0, 0.5, 0.0], abs=1e-8)
    assert falls.answer() == pytest.approx([1.5, 0.0, 4.5, 0.0], abs=1e-7)
    assert not Solution(falls.problem, np.array([1.5, 0.1, 4.5, 0.0])).solved(1e-3)  # planted: the joint slips
    assert not Solution(falls.problem, np.zeros(4)).solved(1e-3)


@pytest.mark.parametrize("relaxed", [True, False])
def test_joints_are_as_if_their_coordinates_were_eliminated(relaxed: bool) -> None:
    """Twelve coordinates tied by five joint rows: the same motion as contacts on the seven that are left."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        root, rows, joint = rng.normal(size=(12, 12)), rng.normal(size=(9, 12)), np.zeros((6, 12))
        joint[:5] = rng.normal(size=(5, 12))  # the sixth component is not there
        mass, free = root @ root.T + np.eye(12), np.linalg.svd(joint)[2][5:].T
        velocity = free @ rng.normal(size=7)
        problem = ImpactProblem.from_impact(mass, np.vstack([joint, rows]), velocity, 0.2, 0.4, relaxed=relaxed,
                                            bilateral=[True, True, False, False, False])  # fmt: skip
        reduced = ImpactProblem.from_impact(free.T @ mass @ free, rows @ free, free.T @ velocity, 0.2, 0.4,
                                            relaxed=relaxed)  # fmt: skip
        for solver in JOINT_SOLVERS:
            solution = solve(problem, solver)
            assert solution.solved(1e-6), (seed, solver, solution.note, solution.residuals)
            if relaxed:
                expected = free @ solve(reduced, "newton_cones").velocity_plus
                assert solution.velocity_plus == pytest.approx(expected, abs=1e-5)
            lifted = Solution(reduced, solution.answer()[6:])  # Coulomb's law may have several answers: all are judged
            assert lifted.solved(1e-5)
        for other in ("pinocchio_admm", "pinocchio_pgs"):
            assert solve(problem, other).verdict() == "refused"


# --- large hyperstatic problems -----------------------------------------------------------------------------------
def brick_wall(layers: int = 5, bricks: int = 8) -> ImpactProblem:
    """A wall of bricks 2 x 1 x 1 in running bond, masses over two decades, one step of gravity: four corners a face.

    Eight and seven bricks by turns make 256 contacts (768 unknowns) of rank 228, as the stacks and towers of FCLIB.
    """
    middle = np.array([[2.0 * i + k % 2, 0.0, k + 0.5] for k in range(layers) for i in range(bricks - k % 2)])
    count, rows = len(middle), []
    for a, (x, _, z) in enumerate(middle):
        below = [b for b in range(count) if middle[b, 2] == z - 1.0 and abs(middle[b, 0] - x) < 2.0] or [-1]
        for b in below:
            other = middle[b, 0] if b >= 0 else x
            for corner in product((max(x, other) - 1.0, min(x, other) + 1.0), (-0.5, 0.5)):
                for way in np.roll(np.eye(3), 1, axis=0):  # up, then along the wall and across
                    row, point = np.zeros((count, 6)), np.array([*corner, z - 0.5])
                    for body, sign in ((a, 1.0), (b, -1.0))[: 1 + (b >= 0)]:
                        row[body] = sign * np.concatenate([way, np.cross(point - middle[body], way)])
                    rows.append(row.ravel())
    mass = 2.0 * 10.0 ** np.random.default_rng(2).uniform(-1.0, 1.0, count)
    diagonal = np.outer(mass, [1.0, 1.0, 1.0, 2.0 / 12.0, 5.0 / 12.0, 5.0 / 12.0]).ravel()
    velocity = np.tile([0.0, 0.0, -0.0981, 0.0, 0.0, 0.0], count)
    return ImpactProblem.from_impact(np.diag(diagonal), np.array(rows), velocity, 0.0, 0.8, name="brick wall")


def test_a_wall_of_768_unknowns_is_solved_by_two() -> None:
    """A wall of bricks stands: Newton and ADMM say so to rounding, the interior point to the root of its accuracy."""
    problem = brick_wall()
    assert (problem.size, np.linalg.matrix_rank(problem.delassus)) == (768, 228)
    with one_thread():
        newton, admm, cone = (solve(problem, name) for name in ("newton_cones", "pinocchio_admm", "cvxpy_socp"))
    assert newton.solved(1e-9), (newton.note, newton.residuals)
    assert admm.solved(1e-9), (admm.note, admm.residuals)
    assert cone.solved(1e-4), (cone.note, cone.residuals)
    for solution in (newton, admm, cone):
        assert np.abs(solution.velocity_plus).max() <= 1e-4 * 0.0981


@pytest.mark.skipif(not PROBLEMS.exists(), reason="shared problem files are not here")
def test_newton_solves_the_stored_problem_on_which_gauss_seidel_creeps() -> None:
    problem = read_problem(PROBLEMS / "fclib" / "fclib__local_problem_test.hdf5").problem
    assert not solve(problem, "nsgs").solved() and solve(problem, "newton_cones").solved(1e-11)
