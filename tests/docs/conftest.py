"""Perform every document once per session and hand its answers to the tests."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # importmode=importlib does not

from blocks import PACKAGES, ROOT, read_blocks

ADDS_TO_THE_PROJECT = ("docs/extending.md",)
WIDTH = "100"  # of the terminal that the documents show
LONGEST = 900  # seconds for one document, kernels compiled anew


def copy_project(folder: Path) -> None:
    """Copy the packages and scenes; compiled kernels are shared with the original, or every run would recompile."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        for cache_folder in (ROOT / name).rglob("__pycache__"):
            (folder / cache_folder.relative_to(ROOT)).symlink_to(cache_folder, target_is_directory=True)
    shutil.copytree(ROOT / "scenes", folder / "scenes")


def perform(name: str, folder: Path) -> None:
    """Perform a document in `folder` and leave answers.json there: a list of answers, or why there are none."""
    work, asked, partial = folder / "work", folder / "blocks.json", folder / "answers.partial"
    work.mkdir()
    if name in ADDS_TO_THE_PROJECT:
        copy_project(work)
    asked.write_text(json.dumps([asdict(block) for block in read_blocks(ROOT / name, name)]))
    environment = {**os.environ, "PYTHONPATH": str(work), "PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": WIDTH,
                   "TERM": "dumb", "NO_COLOR": "1"}
    for variable in ("CI", "BUILD_NUMBER", "PYTEST_ADDOPTS"):  # where these are set, pytest prints more
        environment.pop(variable, None)
    done = subprocess.run([sys.executable, str(Path(__file__).parent / "performing.py"), str(asked), str(partial)],
                          cwd=work, env=environment, capture_output=True, text=True)
    if done.returncode:
        partial.write_text(json.dumps(done.stderr))
    partial.rename(folder / "answers.json")


@pytest.fixture(scope="session")
def answers_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], list[dict[str, Any]]]:
    """Return a function: name of a document -> what each of its blocks printed, and how it failed.

    Workers of pytest-xdist share the work: the first to come performs a document, the others wait for it.
    """
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    @cache
    def answers(name: str) -> list[dict[str, Any]]:
        folder = shared / f"document-{Path(name).stem}"
        try:
            folder.mkdir()
        except FileExistsError:
            _wait_for(folder / "answers.json")
        else:
            perform(name, folder)
        found = json.loads((folder / "answers.json").read_text())
        assert isinstance(found, list), f"{name} could not be performed:\n{found}"
        return found

    return answers


def _wait_for(path: Path) -> None:
    deadline = time.monotonic() + LONGEST
    while not path.exists():
        assert time.monotonic() < deadline, f"another worker did not write {path} in {LONGEST} s"
        time.sleep(0.1)
