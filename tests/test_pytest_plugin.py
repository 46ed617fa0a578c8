"""The pytest plugin, in a repository that is not ours: one test per law, and nothing loaded unless it is used."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
USERS_TEST = """
import pytest
from my_solver import resolve

@pytest.mark.iapb(contract="unilateral", laws=["kinetic_energy", "pushing"], impacts=15)
def test_resolve(iapb_law):
    iapb_law(resolve)
"""
PULLS = "from verification.laws import sound_resolver as resolve\n"
NEWTON = "from tests.verification.laws.faults import newton as resolve\n"


def _pytest(folder: Path, *options: str, test: str = USERS_TEST, solver: str = NEWTON) -> tuple[int, str]:
    """Run pytest in the user's folder with this plugin and no other; return its exit status and its output."""
    (folder / "my_solver.py").write_text(solver)
    (folder / "test_my_solver.py").write_text(test)
    environment = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{folder}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    for name in ("PYTEST_ADDOPTS", "CI", "BUILD_NUMBER"):  # under CI pytest prints an assertion's message twice
        environment.pop(name, None)
    command = [sys.executable, "-m", "pytest", "-p", "pytest_iapb", "-p", "no:cacheprovider", "--strict-markers"]
    done = subprocess.run([*command, *options], cwd=folder, env=environment, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def test_the_entry_point_names_the_plugin() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["pytest11"] == {"iapb": "pytest_iapb"}
    assert (ROOT / "pytest_iapb.py").is_file()


def test_each_law_is_a_test_of_its_own(tmp_path: Path) -> None:
    status, text = _pytest(tmp_path, "-v")
    assert status == 0, text
    for name in ("kinetic_energy", "pushing"):
        assert f"test_resolve[{name}] PASSED" in text
    assert "2 passed" in text


def test_a_broken_law_fails_by_its_name_with_its_matrices_whole(tmp_path: Path) -> None:
    status, text = _pytest(tmp_path, "--iapb-seed", "7", "--iapb-impacts", "25", solver=PULLS)
    assert status == 1 and "1 failed, 1 passed" in text
    assert "test_resolve[pushing]" in text
    for line in ("FAILED on 25 impacts", "counterexample to pushing:", "  M = [[", "  J = [[", "  v = [",
                 "  returned = [", "def test_pushing():", "seed 7"):
        assert line in text
    assert "..." not in text.split("counterexample to pushing:")[1].split("def test_pushing")[0]


def test_plain_pytest_shows_the_matrices_of_an_assertion(tmp_path: Path) -> None:
    """Without the fixture: pytest cuts the message of an assertion at 240 characters unless it is a string."""
    plain = """
from my_solver import resolve
from verification import check_passivity

def test_resolve():
    report = check_passivity(resolve, contract="unilateral", laws=["pushing"], impacts=15)
    assert report.passed, report

def test_raises():
    check_passivity(resolve, contract="unilateral", laws=["pushing"], impacts=15).raise_if_broken()
"""
    status, text = _pytest(tmp_path, test=plain, solver=PULLS)
    assert status == 1 and "2 failed" in text
    assert text.count("  M = [[") == text.count("  returned = [") == text.count("def test_pushing():") == 2


def test_workers_of_xdist_share_the_laws(tmp_path: Path) -> None:
    pytest.importorskip("xdist")
    status, text = _pytest(tmp_path, "-p", "xdist.plugin", "-n", "2", "-v")
    assert status == 0 and "2 passed" in text, text


@pytest.mark.parametrize(
    ("marker", "message"),
    [('laws=["pushin"]', "did you mean"), ('contract="one-sided"', "expected one of equality, unilateral, frictional")],
)
def test_a_wrong_name_in_the_marker_is_refused_with_the_list(tmp_path: Path, marker: str, message: str) -> None:
    test = USERS_TEST.replace('contract="unilateral", laws=["kinetic_energy", "pushing"], impacts=15', marker)
    status, text = _pytest(tmp_path, test=test.replace("pushin", "momentu"))
    assert status == 2 and "marker iapb: " in text and message in text
    assert "Traceback" not in text


@pytest.mark.parametrize("number", ["0", "-3", "many"])
def test_no_impacts_are_refused(tmp_path: Path, number: str) -> None:
    status, text = _pytest(tmp_path, f"--iapb-impacts={number}")
    assert status == 4 and "--iapb-impacts" in text


def test_importing_the_plugin_loads_one_module(tmp_path: Path) -> None:
    count = "import argparse, pytest, sys; old = set(sys.modules); import pytest_iapb; print(*set(sys.modules) - old)"
    done = subprocess.run([sys.executable, "-c", count], cwd=tmp_path, capture_output=True, text=True, check=True,
                          env=os.environ | {"PYTHONPATH": str(ROOT)})  # fmt: skip
    assert done.stdout.split() == ["pytest_iapb"]


def test_a_session_that_does_not_ask_for_it_loads_no_numerics(tmp_path: Path) -> None:
    """Nor a package of ours, so that folders called `verification` or `reports` of the user's own are no trouble."""
    heavy = ("numpy", "numba", "scipy", "hypothesis", "iapb", "reference", "verification", "reports")
    test = f"import sys\n\ndef test_light():\n    assert not set({heavy!r}) & set(sys.modules)\n"
    status, text = _pytest(tmp_path, test=test)
    assert status == 0, text
