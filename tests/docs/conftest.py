"""Perform every document once per session and hand its answers to the tests."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # importmode=importlib does not

from blocks import read_blocks

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("iapb", "reference", "verification", "reports")
ADDS_TO_THE_PROJECT = ("docs/extending.md",)
WIDTH = "100"  # of the terminal that the documents show


def copy_project(folder: Path) -> None:
    """Copy the packages and scenes; compiled kernels are shared with the original, or every run would recompile."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        for cache_folder in (ROOT / name).rglob("__pycache__"):
            (folder / cache_folder.relative_to(ROOT)).symlink_to(cache_folder, target_is_directory=True)
    shutil.copytree(ROOT / "scenes", folder / "scenes")


@pytest.fixture(scope="session")
def answers_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], list[dict[str, Any]]]:
    """Return a function: name of a document -> what each of its blocks printed, and how it failed."""

    @cache
    def perform(name: str) -> list[dict[str, Any]]:
        folder = tmp_path_factory.mktemp(Path(name).stem)
        work = folder / "work"
        work.mkdir()
        if name in ADDS_TO_THE_PROJECT:
            copy_project(work)
        asked, answers = folder / "blocks.json", folder / "answers.json"
        asked.write_text(json.dumps([asdict(block) for block in read_blocks(ROOT / name, name)]))
        environment = {**os.environ, "PYTHONPATH": str(work), "PYTHONDONTWRITEBYTECODE": "1", "COLUMNS": WIDTH,
                       "TERM": "dumb", "NO_COLOR": "1"}
        done = subprocess.run([sys.executable, str(Path(__file__).parent / "performing.py"), str(asked), str(answers)],
                              cwd=work, env=environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        return json.loads(answers.read_text())  # type: ignore[no-any-return]

    return perform
