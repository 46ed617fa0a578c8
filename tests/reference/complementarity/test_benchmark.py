"""The table of solvers on problems, and the profile drawn from it."""

from __future__ import annotations

import numpy as np
import pytest

from reference.complementarity import SOLVERS, ImpactProblem
from reference.complementarity.benchmark import performance_profile, run_solvers
from reference.complementarity.solvers import SolverEntry

STACK = ImpactProblem.from_impact(np.eye(2), [[1.0, 0.0], [-1.0, 1.0], [-1.0, 1.0]], [-1.0, -2.0], 0.0, name="stack")


def test_every_pair_has_a_verdict_and_velocities_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    asymmetric = ImpactProblem.from_delassus([[1.0, 0.0], [2.0, 1.0]], [-1.0, -1.0], name="asymmetric")
    monkeypatch.setitem(SOLVERS, "absent", SolverEntry("nowhere", "not_a_package", "", "lcp"))
    rows = run_solvers([STACK, asymmetric], ["daqp", "gauss_seidel", "nsgs", "absent"])
    verdicts = {(row.problem, row.solver): row.verdict for row in rows}
    assert verdicts["stack", "daqp"] == verdicts["stack", "gauss_seidel"] == "solved"
    assert verdicts["asymmetric", "daqp"] == "refused" and verdicts["stack", "nsgs"] == "refused"
    assert all((row.asymmetry > 0.0) == (row.problem == "asymmetric") for row in rows)
    assert all(row.spread <= 1e-9 for row in rows if row.verdict == "solved")
    missing = [row for row in rows if row.solver == "absent"]
    assert all(row.verdict == "missing" and "pip install" in row.note and row.residuals.worst == np.inf
               for row in missing) and len(missing) == 2  # fmt: skip


def test_a_slow_solver_is_left_out_of_the_next_problems() -> None:
    slow: dict[str, float] = {}
    rows = run_solvers([STACK, STACK], ["daqp"], longest=0.0, slow=slow)
    assert [row.verdict for row in rows] == ["solved", "left out"] and list(slow) == ["daqp"]


def test_profile_counts_only_what_was_solved() -> None:
    unsolvable = ImpactProblem.from_delassus([[0.0]], [-1.0], name="unsolvable")
    profile = performance_profile(run_solvers([STACK, unsolvable], ["daqp", "enumeration"]), np.array([1.0, 1e12]))
    assert {name: shares[-1] for name, shares in profile.items()} == {"daqp": 0.5, "enumeration": 0.5}
    assert sum(shares[0] for shares in profile.values()) == 0.5  # one solver is the fastest on the one problem
