"""The table of solvers on problems, and the profile drawn from it."""

from __future__ import annotations

import numpy as np
import pytest

from reference.complementarity import SOLVERS, ImpactProblem
from reference.complementarity.benchmark import performance_profile, run_solvers
from reference.complementarity.solvers import SolverEntry


def stack() -> ImpactProblem:
    rows = np.array([[1.0, 0.0], [-1.0, 1.0], [-1.0, 1.0]])
    return ImpactProblem.from_impact(np.eye(2), rows, [-1.0, -2.0], 0.0, name="stack")


def test_every_pair_has_a_verdict_and_velocities_agree() -> None:
    asymmetric = ImpactProblem.from_delassus([[1.0, 0.0], [2.0, 1.0]], [-1.0, -1.0], name="asymmetric")
    rows = run_solvers([stack(), asymmetric], ["daqp", "lemke", "gauss_seidel", "nsgs"])
    verdicts = {(row.problem, row.solver): row.verdict for row in rows}
    assert verdicts["stack", "daqp"] == verdicts["stack", "gauss_seidel"] == "solved"
    assert verdicts["asymmetric", "daqp"] == "refused" and verdicts["stack", "nsgs"] == "refused"
    assert all(row.asymmetry > 0.0 for row in rows if row.problem == "asymmetric")
    assert all(row.spread <= 1e-9 for row in rows if row.verdict == "solved")


def test_a_missing_solver_is_a_row_not_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SOLVERS, "absent", SolverEntry("nowhere", "not_a_package", "", "lcp"))
    (row,) = run_solvers([stack()], ["absent"])
    assert row.verdict == "missing" and "pip install" in row.note and row.residuals.worst == np.inf


def test_profile_counts_only_what_was_solved() -> None:
    unsolvable = ImpactProblem.from_delassus([[0.0]], [-1.0], name="unsolvable")
    rows = run_solvers([stack(), unsolvable], ["daqp", "enumeration"])
    profile = performance_profile(rows, np.array([1.0, 1e12]))
    assert {name: shares[-1] for name, shares in profile.items()} == {"daqp": 0.5, "enumeration": 0.5}
    assert (
        sum(shares[0] for shares in profile.values()) == 0.5
    )  # one solver is the fastest on the one problem
