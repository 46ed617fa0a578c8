"""Every solver answers the same question: compare velocities and residuals, never impulses;
friction by hand."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SolverError
from reference.complementarity import SOLVERS, ImpactProblem, Solution, solve, solver_names
from reference.complementarity.benchmark import run_solvers
from reference.complementarity.solution import project_on_cone, residuals
from reference.complementarity.solvers import SolverEntry

ROOT = Path(__file__).resolve().parents[3]
# What each solver reaches on small redundant problems, relative velocity, with a factor ten of
# room.
REACHED = {"proxqp": 1e-5, "cvxpy_scs": 1e-5, "cvxpy_osqp": 1e-6, "cvxpy_clarabel": 1e-8}
# quadprog and Lemke can end without an answer on exactly redundant rows, Gauss-Seidel can be too
# slow on nearly dependent ones; their solution must then judge itself unsolved, and in a few of the
# SEEDS only.
MAY_FAIL = {"quadprog", "lemke", "gauss_seidel"}
SEEDS = 12
FAILURES_ALLOWED = 2


@pytest.mark.parametrize("name", [name for name in SOLVERS if SOLVERS[name].takes != "cone"])
def test_solvers_agree_with_enumeration_by_velocities(name: str) -> None:
    failures = 0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        d = rng.integers(1, 7)
        c = rng.integers(1, 8)
        rank = rng.integers(1, d + 1)
        root = rng.normal(size=(d, d))
        rows = rng.normal(size=(c, rank)) @ rng.normal(size=(rank, d))
        problem = ImpactProblem.from_impact(
            root @ root.T + 0.1 * np.eye(d), rows, rng.normal(size=d), rng.uniform()
        )
        truth = solve(problem, "enumeration").velocity_plus
        solution = solve(problem, name)
        if name in MAY_FAIL and not solution.solved():
            assert solution.verdict() == "failed"
            failures += 1
            continue
        assert solution.solved(), (seed, solution.note, solution.residuals)
        error = np.abs(solution.velocity_plus - truth).max() / np.abs(problem.velocity).max()
        assert error <= REACHED.get(name, 1e-10)
    assert failures <= FAILURES_ALLOWED


@pytest.mark.parametrize(
    "wrong",
    [
        [0.0, 0.0],
        [-1.0, 3.0],
        [5.0, 5.0],
        [np.nan, 1.0],
        [1.0, 1.0, 0.0],
        None,
    ],
)
def test_planted_wrong_solutions_are_judged_unsolved(wrong: list[float] | None) -> None:
    problem = ImpactProblem.from_delassus([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    assert Solution(problem, np.array(solve(problem).impulse)).solved(1e-12)
    planted = Solution(problem, None if wrong is None else np.array(wrong), note="optimal to 1e-16")
    assert not planted.solved() and (wrong is not None or planted.residuals.worst == np.inf)


def test_asymmetric_and_indefinite_matrices_are_refused_by_convex_solvers() -> None:
    asymmetric = ImpactProblem.from_delassus([[1.0, 0.0], [2.0, 1.0]], [-1.0, -1.0])
    indefinite = ImpactProblem.from_delassus([[0.0, 1.0], [1.0, 0.0]], [-1.0, -1.0])
    for problem, says in ((asymmetric, "asymmetric"), (indefinite, "indefinite")):
        with pytest.raises(SolverError):
            _ = problem.factor
        assert solve(problem, "daqp").verdict() == "refused" and says in solve(problem, "daqp").note
        assert solve(problem, "enumeration").solved(1e-12)


def test_a_problem_without_solution_is_solved_by_nobody_and_one_without_contacts_by_all() -> None:
    """w = -1 whatever p: the rows forbid what the velocity demands."""
    problem = ImpactProblem.from_delassus([[0.0]], [-1.0])
    assert all(not solve(problem, name).solved() for name in solver_names(problem))
    nothing = ImpactProblem.from_impact(np.eye(2), np.zeros((0, 2)), [1.0, 2.0], 0.5)
    for solution in (solve(nothing, name) for name in solver_names(nothing)):
        assert solution.solved() and np.array_equal(solution.velocity_plus, [1.0, 2.0]), (
            solution.solver
        )


@pytest.mark.parametrize("scale", [1e-12, 1e-9, 1.0, 1e9])
def test_enumeration_finds_solutions_at_every_scale(scale: float) -> None:
    """Rank one, W = s·1, b = −1: every p >= 0 with the sum 1/s solves it; with W = −s·1 none
    does."""
    for sign in (1.0, -1.0):
        problem = ImpactProblem.from_delassus(sign * scale * np.ones((3, 3)), -np.ones(3))
        assert solve(problem, "enumeration").solved(1e-12) == (sign > 0.0)


LCP = ImpactProblem.from_delassus
IMPACT = ImpactProblem.from_impact


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: solve(LCP([[1.0]], [0.0]), "simplex"), "one of enumeration"),
        (lambda: IMPACT(np.eye(1), [[1.0]], [1.0], [0.5, 0.5]), "restitution"),
        (lambda: IMPACT(np.eye(3), np.eye(3), np.ones(3), 0.0, -0.1), "friction"),
        (lambda: IMPACT(-np.eye(1), [[1.0]], [1.0], 1.0), "positive definite"),
        (lambda: LCP([[1.0]], [1.0]).velocity_plus(np.ones(1)), "from_impact"),
    ],
)
def test_refusals(call: Callable[[], Any], says: str) -> None:
    with pytest.raises(ArgumentError, match=says):
        call()


@pytest.mark.thorough
def test_processes_that_import_quantecon_for_the_first_time_at_once_do_not_spoil_its_cache(
    tmp_path: Path,
) -> None:
    """Without `import_alone`'s lock some of them abort, and so does every later import, most of the
    time.

    Both ways in are tried: the compiled solver, and `solve`, which asks for the package first.
    """
    found = find_spec("quantecon")
    assert found is not None and found.origin is not None
    shutil.copytree(
        Path(found.origin).parent, tmp_path / "quantecon", ignore=shutil.ignore_patterns("*.nb?")
    )
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    environment.pop("NUMBA_CACHE_DIR", None)
    script = """
import sys
from numba import njit
for _ in range(int(sys.argv[1])):  # numba numbers what it compiles: the processes' numbers differ
    njit(lambda x: x)(1)
from reference.complementarity.solvers import SOLVERS, _load
from reference.complementarity.solvers.lemke import import_lcp_lemke
_load("lemke", SOLVERS["lemke"]) if int(sys.argv[1]) else import_lcp_lemke()
"""
    for counts in ((0, 4, 8), (0,)):
        started = [
            subprocess.Popen([sys.executable, "-c", script, str(k)], env=environment, cwd=tmp_path)
            for k in counts
        ]
        assert not any(process.wait() for process in started)


STACK = ImpactProblem.from_impact(
    np.eye(2), [[1.0, 0.0], [-1.0, 1.0], [-1.0, 1.0]], [-1.0, -2.0], 0.0, name="stack"
)


def test_every_pair_has_a_verdict_and_velocities_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    skew = ImpactProblem.from_delassus([[1.0, 0.0], [2.0, 1.0]], [-1.0, -1.0], name="skew")
    monkeypatch.setitem(SOLVERS, "absent", SolverEntry("nowhere", "not_a_package", "", "lcp"))
    rows = [row for problem in (STACK, skew) for row in run_solvers(problem, np.inf, set())]
    verdicts = {(row.problem, row.solver): row.verdict for row in rows}
    assert verdicts["stack", "daqp"] == verdicts["stack", "gauss_seidel"] == "solved"
    assert verdicts["skew", "daqp"] == "refused"
    assert all(row.spread <= 1e-9 for row in rows if row.verdict == "solved")
    assert verdicts["stack", "absent"] == verdicts["skew", "absent"] == "missing"
    everything = {row.solver for row in rows}
    assert {row.verdict for row in run_solvers(STACK, 0.0, everything)} == {"left out"}


CONE_SOLVERS = ("nsgs", "cvxpy_socp", "pinocchio_pgs", "pinocchio_admm")


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


RELAXED_SOLVERS = ("nsgs", "cvxpy_socp", "pinocchio_admm")


@pytest.mark.parametrize("solver", RELAXED_SOLVERS)
def test_the_relaxed_law_lifts_off_where_it_slides(solver: str) -> None:
    """What the convex relaxation costs: sliding bodies separate with mu times their sliding
    speed."""
    solution = solve(mass_on_a_plane([-1.0, 3.0, 4.0], 0.5, relaxed=True), solver)
    v = solution.velocity_plus
    assert solution.solved(1e-7)
    assert v[0] == pytest.approx(0.5 * np.hypot(v[1], v[2]), rel=1e-6) and v[0] > 0.1


@pytest.mark.parametrize("relaxed", [True, False])
def test_solvers_agree_on_random_problems(relaxed: bool) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        root = rng.normal(size=(6, 6))
        rows = rng.normal(size=(3 * int(rng.integers(1, 4)), 6))
        problem = ImpactProblem.from_impact(
            root @ root.T + np.eye(6), rows, rng.normal(size=6), 0.2, 0.3, relaxed=relaxed
        )
        solutions = [
            solve(problem, name) for name in (RELAXED_SOLVERS if relaxed else CONE_SOLVERS)
        ]
        for solution in solutions:
            assert solution.solved(1e-5), (seed, solution.solver, solution.note, solution.residuals)
            if relaxed:  # convex: one velocity; Coulomb's law may have several
                assert np.abs(solution.velocity_plus - solutions[0].velocity_plus).max() <= 1e-5


@hypothesis_settings(max_examples=50)
@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3), st.floats(0.0, 2.0))
def test_projection_obeys_moreau(x: list[float], mu: float) -> None:
    """x = proj_K(x) − proj_K*(−x), the two parts orthogonal, each in its cone."""
    point = np.array([x])
    friction = np.array([mu])
    inside = project_on_cone(point, friction)
    rest = inside - point  # lies in the dual cone
    assert np.abs(project_on_cone(inside, friction) - inside).max() <= 1e-12
    assert abs((inside * rest).sum()) <= 1e-12
    assert rest[0, 0] >= mu * np.linalg.norm(rest[0, 1:]) - 1e-12


@pytest.mark.parametrize("name", ["daqp", "enumeration", "cvxpy_osqp", "cvxpy_clarabel"])
def test_opposed_contacts_whose_velocities_are_rounding_have_an_answer(name: str) -> None:
    """J v is rounding of v, and contradicts itself on dependent rows: J v = (1e-17, 1e-17) between
    two walls."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        half = rng.integers(-4, 5, size=(3, 2)) @ rng.normal(size=(2, 4))
        rows = np.vstack([half, -half])
        unseen = np.linalg.svd(rows)[2][2:]
        v = unseen.T @ rng.normal(size=2)
        solution = solve(
            ImpactProblem.from_impact(np.diag([1.0, 2.0, 0.1, 3.0]), rows, v, 0.5), name
        )
        assert np.abs(solution.velocity_plus - v).max() <= 1e-14


@pytest.mark.parametrize(
    ("rows", "v"),
    [
        ([[1, -1, 1], [-1, 1, -1], [1, -1, 0], [0, 0, 1]], [300.0, 300.0, -1e-13]),
        ([[-1.0, 1.0, 0.0]], [7600.0, 7600.0 - 2e-11, 0.0]),
    ],
)
def test_a_contact_slower_than_the_rounding_of_others_is_stopped(
    rows: list[list[float]], v: list[float]
) -> None:
    """It is exact in doubles: only where every velocity of dependent rows is rounding, b is 0."""
    problem = ImpactProblem.from_impact(np.eye(3), rows, v, 0.0)
    assert problem.offset.any() and solve(problem, "daqp").residuals.worst <= 1e-9


def test_clarabel_answers_at_a_coarser_accuracy_where_it_has_none_at_its_finest() -> None:
    """At 1e-11 it ends with "insufficient progress" on this impact."""
    rows = [
        [-0.28890221703031826, 0.68712190360312, -0.666632581399823],
        [-0.03620332447787944, 0.8443086648825759, -0.5346327690115442],
        [-0.23874456508595573, -0.8245166294050235, 0.5130042499594881],
        [-0.00227005170381101, -0.7112722333852035, -0.7029129795931262],
        [0.0, 0.0, 0.0],
    ]
    problem = ImpactProblem.from_impact(8.0 * np.eye(3), rows, [512.0, 0, 0], 0.25268255065800826)
    solution = solve(problem, "cvxpy_clarabel")
    assert solution.residuals.worst <= 1e-6


def test_lemke_answers_where_its_pivots_end_on_a_ray() -> None:
    """Nearly parallel and exactly opposed rows; the contacts that push on the ray are the
    solution's."""
    mass = [[1.0, 0.00820634], [0.00820634, 0.00016628]]
    rows = [[-0.72, -0.7], [0.73, 0.68], [-0.73, -0.68]]
    problem = ImpactProblem.from_impact(mass, rows, [-1.0, 117.0], 1.0)
    assert solve(problem, "lemke").residuals.worst <= 1e-9


@pytest.mark.parametrize(
    ("impulse", "expected"),
    [
        (0.0, (0.0, 1.0, 0.0, 1.0)),  # the contact still closes
        (-1.0, (1.0, 2.0, 2.0, 2.0)),  # it pulls
        (2.0, (0.0, 0.0, 1.0, 1.0)),  # it pushes while it opens
        (1.0, (0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_each_residual_says_what_is_wrong(impulse: float, expected: tuple[float, ...]) -> None:
    """W = 1, b = −1: cone of the impulse, cone of the velocity, complementarity, natural map."""
    found = residuals(ImpactProblem.from_delassus(np.eye(1), [-1.0]), np.array([impulse]))
    names = ("impulse_cone", "velocity_cone", "complementarity", "natural_map")
    assert tuple(getattr(found, name) for name in names) == expected
