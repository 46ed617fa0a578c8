"""Every solver answers the same question: compare velocities and residuals, never impulses."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iapb.errors import ArgumentError, MissingDependencyError, SolverError
from reference import siconos_bridge as siconos
from reference.complementarity import SOLVERS, ImpactProblem, Solution, solve, solver_names
from reference.complementarity.solvers import SolverEntry
from reference.complementarity.solvers.enumeration import all_solutions

ROOT = Path(__file__).resolve().parents[3]
# What each solver reaches on small redundant problems, relative velocity, with a factor ten of room.
REACHED = {"proxqp": 1e-5, "cvxpy_scs": 1e-5, "cvxpy_osqp": 1e-6, "cvxpy_clarabel": 1e-8}
# quadprog and Lemke can end without an answer on exactly redundant rows, Gauss-Seidel can be too slow on
# nearly dependent ones; their solution must then judge itself unsolved, and in a few of the SEEDS only.
MAY_FAIL = {"quadprog", "lemke", "siconos_lemke", "gauss_seidel"}
SEEDS, FAILURES_ALLOWED = 12, 2


def here() -> bool:
    try:
        return bool(siconos.start())
    except MissingDependencyError:
        return False


def installed(names: Iterable[str]) -> list[str]:
    """Without the solvers of the machine where it has none."""
    return [name for name in names if SOLVERS[name].package != "siconos" or here()]


@pytest.mark.parametrize("name", [name for name in SOLVERS if SOLVERS[name].takes != "cone"])
def test_solvers_agree_with_enumeration_by_velocities(name: str) -> None:
    if not installed([name]):
        pytest.skip(f"{name}: {siconos.INSTALL}")
    failures = 0
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        d, c = rng.integers(1, 7), rng.integers(1, 8)
        rank, root = rng.integers(1, d + 1), rng.normal(size=(d, d))
        rows = rng.normal(size=(c, rank)) @ rng.normal(size=(rank, d))
        problem = ImpactProblem.from_impact(root @ root.T + 0.1 * np.eye(d), rows, rng.normal(size=d), rng.uniform())
        truth, solution = solve(problem, "enumeration").velocity_plus, solve(problem, name)
        if name in MAY_FAIL and not solution.solved():
            assert solution.verdict() == "failed"
            failures += 1
            continue
        assert solution.solved(), (seed, solution.note, solution.residuals)
        error = np.abs(solution.velocity_plus - truth).max() / np.abs(problem.velocity).max()
        assert error <= REACHED.get(name, 1e-10)
    assert failures <= FAILURES_ALLOWED


def test_redundant_contacts_have_many_impulses_and_one_velocity() -> None:
    """A block on two equal corners, each struck twice: impulses differ, velocities do not."""
    rows = np.array([[1.0, 0.5], [1.0, -0.5], [1.0, 0.5], [1.0, -0.5]])
    problem = ImpactProblem.from_impact(np.diag([1.0, 0.1]), rows, [-1.0, 0.2], 0.3)
    velocities = [problem.velocity_plus(p) for p in all_solutions(problem)]
    assert len(velocities) > 1 and max(np.abs(v - velocities[0]).max() for v in velocities) <= 1e-12


@pytest.mark.parametrize(
    "wrong", [[0.0, 0.0], [-1.0, 3.0], [5.0, 5.0], [np.nan, 1.0], [np.inf, 1.0], [1.0], [1.0, 1.0, 0.0], None]
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
    assert all(not solve(problem, name).solved() for name in installed(solver_names(problem)))
    nothing = ImpactProblem.from_impact(np.eye(2), np.zeros((0, 2)), [1.0, 2.0], 0.5)
    for solution in (solve(nothing, name) for name in installed(solver_names(nothing))):
        assert solution.solved() and np.array_equal(solution.velocity_plus, [1.0, 2.0]), solution.solver


def test_two_sided_rows_are_met_by_all_that_take_them() -> None:
    """A joint and a contact on one mass: the joint holds with a negative impulse, e or not; the contact stays open."""
    rows = np.array([[1.0, 0.0], [0.6, 0.8]])
    joint = ImpactProblem.from_delassus(rows @ rows.T, rows @ [1.0, 0.5], 0.5, bilateral=[True, False])
    taking = [name for name in installed(solver_names(joint)) if SOLVERS[name].bilateral]
    for solution in (solve(joint, name) for name in taking):
        assert solution.solved(1e-8), (solution.solver, solution.note, solution.residuals)
        assert solution.answer() == pytest.approx([-1.0, 0.0], abs=1e-7)
    assert len(taking) >= 4 and solve(joint, "lemke").verdict() == "refused"
    assert not Solution(joint, np.zeros(2)).solved()


@pytest.mark.parametrize("scale", [1e-12, 1e-9, 1.0, 1e9])
def test_enumeration_finds_solutions_at_every_scale(scale: float) -> None:
    """Rank one, W = s·1, b = −1: every p >= 0 with the sum 1/s solves it, as joints and as contacts."""
    for bilateral in (None, [True, True, True]):
        problem = ImpactProblem.from_delassus(scale * np.ones((3, 3)), -np.ones(3), bilateral=bilateral)
        assert solve(problem, "enumeration").solved(1e-12)
    impossible = ImpactProblem.from_delassus(scale * np.ones((2, 2)), [-1.0, -2.0], bilateral=[True, True])
    assert not solve(impossible, "enumeration").solved()


LCP, IMPACT = ImpactProblem.from_delassus, ImpactProblem.from_impact


@pytest.mark.parametrize(("call", "says"), [
    (lambda: solve(LCP([[1.0]], [0.0]), "simplex"), "one of enumeration"),
    (lambda: IMPACT(np.eye(1), [[1.0]], [1.0], 1.5), "restitution"),
    (lambda: IMPACT(np.eye(1), [[1.0]], [1.0], [0.5, 0.5]), "restitution"),
    (lambda: IMPACT(np.eye(3), np.eye(3), np.ones(3), 0.0, -0.1), "friction"),
    (lambda: IMPACT(np.eye(2), [[1.0]], [1.0, 0.0], 1.0), "contact_jacobian"),
    (lambda: IMPACT(-np.eye(1), [[1.0]], [1.0], 1.0), "positive definite"),
    (lambda: IMPACT(np.eye(2), np.eye(2), np.ones(2), 0.0, 0.5), "divisor"),
    (lambda: LCP([[np.nan]], [1.0]), "finite"), (lambda: LCP([[1.0, 0.0]], [1.0]), "delassus"),
    (lambda: LCP([[1.0]], [1.0], bilateral=[True, False]), "bilateral"),
    (lambda: LCP([[1.0]], [1.0]).velocity_plus(np.ones(1)), "from_impact"),
])  # fmt: skip
def test_refusals(call: Callable[[], Any], says: str) -> None:
    with pytest.raises(ArgumentError, match=says):
        call()


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SOLVERS, "absent", SolverEntry("nowhere", "not_a_package", "", "lcp"))
    with pytest.raises(MissingDependencyError, match="pip install not_a_package"):
        solve(LCP([[1.0]], [0.0]), "absent")


@pytest.mark.parametrize("python", ["/nowhere/python3", "/bin/false"])
def test_without_siconos_the_error_says_how_to_install_it(python: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """No such Python, and one that ends without Siconos."""
    monkeypatch.setattr(siconos, "SYSTEM_PYTHON", python)
    monkeypatch.setattr(siconos, "_running", [])
    with pytest.raises(MissingDependencyError, match="apt-get install python3-siconos"):
        solve(LCP([[1.0]], [-1.0]), "siconos_lemke")


@pytest.mark.skipif(not here(), reason=f"no Siconos in the system's Python ({siconos.INSTALL})")
def test_siconos_answers_as_we_do_and_a_dead_process_is_a_failed_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    skew = LCP([[1.0, 2.0], [0.0, 1.0]], [-1.0, -1.5])
    solution = solve(skew, "siconos_lemke")  # rows taken for columns would give (1, 0)
    assert solution.solved(1e-12) and solution.answer() == pytest.approx([0.0, 1.5], abs=1e-12)
    assert 0.0 < solution.seconds < 1.0
    rng = np.random.default_rng(5)
    for name in ("siconos_nsgs", "siconos_newton"):
        problem = IMPACT(np.eye(6), rng.normal(size=(6, 6)), rng.normal(size=6), 0.0, 0.4)
        theirs, ours = solve(problem, name), solve(problem, "nsgs")
        assert theirs.solved(1e-8) and theirs.gamma_plus == pytest.approx(ours.gamma_plus, abs=1e-6)
    relaxed = IMPACT(np.eye(3), np.eye(3), [-1.0, 0.3, 0.0], 0.0, 0.5, relaxed=True)
    assert solve(relaxed, "siconos_nsgs").verdict() == "refused"
    dead = siconos.start()
    dead.kill()
    dead.wait()
    with monkeypatch.context() as patch:
        patch.setattr(siconos, "start", lambda: dead)
        assert solve(skew, "siconos_lemke").verdict() == "failed"
    assert solve(skew, "siconos_lemke").solved()


def test_processes_that_import_quantecon_for_the_first_time_at_once_do_not_spoil_its_cache(tmp_path: Path) -> None:
    """Without `import_alone`'s lock some of them abort, and so does every later import, most of the time.

    Both ways in are tried: the compiled solver, and `solve`, which asks for the package first.
    """
    found = find_spec("quantecon")
    assert found is not None and found.origin is not None
    shutil.copytree(Path(found.origin).parent, tmp_path / "quantecon", ignore=shutil.ignore_patterns("*.nb?"))
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
        started = [subprocess.Popen([sys.executable, "-c", script, str(k)], env=environment, cwd=tmp_path)
                   for k in counts]  # fmt: skip
        assert not any(process.wait() for process in started)
