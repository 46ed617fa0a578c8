"""Siconos where the machine has it; the named error where it has not; a process that dies is a failed solve."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.errors import MissingDependencyError
from reference import siconos_bridge as siconos
from reference.complementarity import ImpactProblem, solve
from reference.complementarity.benchmark import run_solvers


def _here() -> bool:
    try:
        siconos.start()
    except MissingDependencyError:
        return False
    return True


needs_siconos = pytest.mark.skipif(not _here(), reason=f"no Siconos in the system's Python ({siconos.INSTALL})")
SKEW = ImpactProblem.from_delassus([[1.0, 2.0], [0.0, 1.0]], [-1.0, -1.5], name="skew")


@needs_siconos
def test_an_asymmetric_matrix_arrives_as_it_is() -> None:
    """Rows taken for columns would give (1, 0)."""
    solution = solve(SKEW, "siconos_lemke")
    assert solution.solved(1e-12) and solution.answer() == pytest.approx([0.0, 1.5], abs=1e-12)


@needs_siconos
@pytest.mark.parametrize("name", ["siconos_nsgs", "siconos_newton"])
def test_friction_gives_the_same_velocities_as_our_own_sweeps(name: str) -> None:
    rng = np.random.default_rng(5)
    for _ in range(5):
        rows = rng.normal(size=(6, 6))
        problem = ImpactProblem.from_impact(np.eye(6), rows, rng.normal(size=6), 0.0, 0.4)
        theirs, ours = solve(problem, name), solve(problem, "nsgs")
        assert theirs.solved(1e-8), theirs.note
        assert theirs.gamma_plus == pytest.approx(ours.gamma_plus, abs=1e-6)


@needs_siconos
def test_it_keeps_its_own_time_and_refuses_the_relaxed_law() -> None:
    assert 0.0 < solve(SKEW, "siconos_lemke").seconds < 1.0
    relaxed = ImpactProblem.from_impact(np.eye(3), np.eye(3), [-1.0, 0.3, 0.0], 0.0, 0.5, relaxed=True)
    assert solve(relaxed, "siconos_nsgs").verdict() == "refused"


@needs_siconos
def test_a_dead_process_is_a_failed_solve_and_the_next_gets_a_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    dead = siconos.start()
    dead.kill()
    dead.wait()
    with monkeypatch.context() as patch:
        patch.setattr(siconos, "start", lambda: dead)
        assert solve(SKEW, "siconos_lemke").verdict() == "failed"
    assert solve(SKEW, "siconos_lemke").solved()


@pytest.mark.parametrize("python", ["/nowhere/python3", "/bin/false"])
def test_without_it_the_error_says_how_to_install_it(python: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """No such Python, and one that ends without Siconos."""
    monkeypatch.setattr(siconos, "SYSTEM_PYTHON", python)
    monkeypatch.setattr(siconos, "_running", [])
    with pytest.raises(MissingDependencyError, match="apt-get install python3-siconos"):
        solve(SKEW, "siconos_lemke")
    (row,) = run_solvers([SKEW], ["siconos_lemke"])
    assert row.verdict == "missing" and "apt-get" in row.note
