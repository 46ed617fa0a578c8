"""The trial of the packages asks for the lowest versions allowed, and what it runs in each environment runs."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib

import pytest

from tools.packages import ROOT, TRIAL, VERDICT, lowest


@pytest.mark.parametrize("extra", ["", "reference", "verify", "report", "all"])
def test_lowest_versions_are_those_of_the_project_and_of_the_extras_inside_an_extra(extra: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    inside = ("reference", "verify", "report", "all")
    extras = inside[: inside.index(extra) + 1] if extra else ()
    bounds = project["dependencies"] + [one for name in extras for one in project["optional-dependencies"][name]]
    wanted = {one.partition(">=")[0]: one.partition(">=")[2].partition(",")[0].partition(";")[0] for one in bounds
              if not one.startswith("iapb[")}  # fmt: skip
    assert {one.partition("==")[0]: one.partition("==")[2].partition(";")[0] for one in lowest(extra)} == wanted


@pytest.mark.parametrize(("code", "says"), [(TRIAL, "bits"), (VERDICT, "passed")])
def test_a_trial_runs_and_says_what_the_table_needs(code: str, says: str) -> None:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)[says]
