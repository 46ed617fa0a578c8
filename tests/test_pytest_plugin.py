"""The pytest plugin, in a repository that is not ours: one test per law, and nothing loaded unless
it is used."""

import argparse
import os
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

import pytest_iapb

ROOT = Path(__file__).resolve().parents[1]
MARKED = 'contract="unilateral", laws=["kinetic_energy", "pushing"], impacts=15'
USERS_TEST = f"""
import pytest
from my_solver import resolve

@pytest.mark.iapb({MARKED})
def test_resolve(iapb_law):
    iapb_law(resolve)
"""
PLAIN = """
from verification import check_passivity

def test_plain():
    report = check_passivity(resolve, contract="unilateral", laws=["pushing"], impacts=15)
    assert report.passed, report

def test_raises():
    check_passivity(resolve, contract="unilateral", laws=["pushing"], impacts=15).raise_if_broken()
"""
PULLS = "from verification.laws import sound_resolver as resolve\n"
NEWTON = "from tests.verification.laws.faults import newton as resolve\n"


@pytest.fixture
def user(tmp_path):
    """Run pytest in the user's folder with this plugin and no other; return its exit status and its
    output."""

    def run(*options, test=USERS_TEST, solver=NEWTON):
        (tmp_path / "my_solver.py").write_text(solver)
        (tmp_path / "test_my_solver.py").write_text(test)
        path = f"{ROOT}{os.pathsep}{tmp_path}"
        environment = os.environ | {"PYTHONPATH": path, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
        for name in (
            "PYTEST_ADDOPTS",
            "CI",
            "BUILD_NUMBER",
        ):  # under CI pytest prints an assertion's message twice
            environment.pop(name, None)
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-p",
            "pytest_iapb",
            "-p",
            "no:cacheprovider",
            "--strict-markers",
        ]
        done = subprocess.run(
            [*command, *options], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        return done.returncode, done.stdout + done.stderr

    return run


def test_each_law_is_a_test_of_its_own_and_workers_of_xdist_share_the_laws(user):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert (
        project["entry-points"]["pytest11"] == {"iapb": "pytest_iapb"}
        and (ROOT / "pytest_iapb.py").is_file()
    )
    status, text = user("-v", *(("-p", "xdist.plugin", "-n", "2") if find_spec("xdist") else ()))
    assert status == 0 and "2 passed" in text, text
    assert "test_resolve[kinetic_energy]" in text and "test_resolve[pushing]" in text


def test_a_broken_law_fails_by_its_name_with_its_matrices_whole_and_so_does_an_assertion(user):
    """Without the fixture, pytest cuts the message of an assertion at 240 characters unless it is a
    string."""
    status, text = user(
        "--iapb-seed", "7", "--iapb-impacts", "25", test=USERS_TEST + PLAIN, solver=PULLS
    )
    assert status == 1 and "3 failed, 1 passed" in text, text
    for line in (
        "test_resolve[pushing]",
        "FAILED on 25 impacts",
        "counterexample to pushing:",
        "  J = [[",
        "  v = [",
        "seed 7",
    ):
        assert line in text
    assert (
        text.count("  M = [[")
        == text.count("  returned = [")
        == text.count("def test_pushing():")
        == 3
    )
    assert "..." not in text.split("counterexample to pushing:")[1].split("def test_pushing")[0]


def test_a_wrong_name_in_the_marker_is_refused_with_the_list(user, tmp_path):
    (tmp_path / "test_other.py").write_text(USERS_TEST.replace(MARKED, 'contract="one-sided"'))
    status, text = user(test=USERS_TEST.replace(MARKED, 'laws=["momentu"]'))
    assert status == 2 and text.count("marker iapb: ") >= 2 and "Traceback" not in text
    assert "did you mean" in text and "expected one of equality, unilateral, frictional" in text


def test_no_impacts_are_refused(capsys):
    parser = argparse.ArgumentParser()
    parser.getgroup = lambda *_: SimpleNamespace(addoption=parser.add_argument)
    pytest_iapb.pytest_addoption(parser)
    for number in ("0", "-3", "many"):
        with pytest.raises(SystemExit):
            parser.parse_args([f"--iapb-impacts={number}"])
        assert "--iapb-impacts" in capsys.readouterr().err


def test_a_session_that_does_not_ask_for_it_loads_no_numerics(user):
    """Nor a package of ours, so that folders called `verification` or `reports` of the user's own
    are no trouble."""
    heavy = (
        "numpy",
        "numba",
        "scipy",
        "hypothesis",
        "iapb",
        "reference",
        "verification",
        "reports",
    )
    status, text = user(
        test=f"import sys\n\ndef test_light():\n    assert not set({heavy!r}) & set(sys.modules)\n"
    )
    assert status == 0, text
