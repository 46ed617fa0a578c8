"""The trial of the packages asks for the lowest versions allowed, and what it runs in each
environment runs."""

import json
import subprocess
import sys

import pytest

from tools.packages import TRIAL, VERDICT, lowest


def test_the_lowest_versions_are_those_of_the_project_and_of_the_extras_inside_an_extra():
    assert {"numpy", "pydantic"} <= {one.partition("==")[0] for one in lowest("")}
    assert {"numpy", "h5py", "hypothesis", "cvxpy"} <= {
        one.partition("==")[0] for one in lowest("all")
    }


@pytest.mark.parametrize(("code", "says"), [(TRIAL, "bits"), (VERDICT, "passed")])
def test_a_trial_runs_without_numba_and_says_what_the_table_needs(code, says):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)[says]
