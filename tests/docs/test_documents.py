"""Every block of the documents is performed, and every example; what they show is what comes out.

`IAPB_UPDATE_DOCS=1 pytest -m '' tests/docs` writes today's outputs into the documents; shortened ones stay.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # importmode=importlib does not

from blocks import ROOT, read_blocks
from comparing import differs

from iapb.scene import find_scene, load_scene
from reference.worlds import run_world
from reports.cli import main
from reports.evidence.runs import TILTED
from reports.figures.figure import draw, standalone
from reports.figures.tilts import hero
from verification.claims.conditions import IGNORED, Condition

PICTURES = ROOT / "docs/pictures"
PACKAGES = ("iapb", "reference", "verification", "reports")
ADDS_TO_THE_PROJECT = ("docs/extending.md",)
DOCUMENTS = ("README.md", *(pytest.param(f"docs/{name}.md", marks=pytest.mark.thorough) for name in
                            ("tutorial", "extending", "scenes", "resolvers", "questions")))  # fmt: skip
WIDTH = "100"  # of the terminal that the documents show


def copy_project(folder: Path) -> None:
    """Copy the packages and scenes; compiled kernels are shared with the original, or every run would recompile."""
    for name in PACKAGES:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        for cache_folder in (ROOT / name).rglob("__pycache__"):
            (folder / cache_folder.relative_to(ROOT)).symlink_to(cache_folder, target_is_directory=True)
    shutil.copytree(ROOT / "scenes", folder / "scenes")


@pytest.mark.parametrize("name", DOCUMENTS)
def test_document(name: str, tmp_path: Path) -> None:
    work, told = tmp_path / "work", tmp_path / "answers.json"
    work.mkdir()
    if name in ADDS_TO_THE_PROJECT:
        copy_project(work)
    environment = {**os.environ, "PYTHONPATH": f"{work}{os.pathsep}{ROOT}", "PYTHONDONTWRITEBYTECODE": "1",
                   "COLUMNS": WIDTH, "TERM": "dumb", "NO_COLOR": "1"}  # fmt: skip
    for variable in ("CI", "BUILD_NUMBER", "PYTEST_ADDOPTS"):  # where these are set, pytest prints more
        environment.pop(variable, None)
    done = subprocess.run([sys.executable, str(Path(__file__).parent / "performing.py"), name, str(told)],
                          cwd=work, env=environment, capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0, done.stderr
    makefile = (ROOT / "Makefile").read_text()
    pairs, wrong = list(zip(read_blocks(name), json.loads(told.read_text()), strict=True)), []
    for block, answer in pairs:
        difference = "" if block.expected is None else differs(answer["output"], block.expected)
        if answer["failure"] or difference and not os.environ.get("IAPB_UPDATE_DOCS"):
            wrong.append(f"{block.id}: {answer['failure'] or difference}\n\n{answer['output']}")
        targets = re.findall(r"^make (\w+)", block.source, flags=re.M) if block.kind == "sh" else []
        wrong += [f"{block.id}: no make target {target!r}" for target in targets if f"\n{target}:" not in makefile]
    if os.environ.get("IAPB_UPDATE_DOCS"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for block, answer in reversed(pairs):
            if block.expected is not None and "…" not in block.expected:
                lines = [line.rstrip() for line in answer["output"].strip("\n").splitlines()]
                text = text[: block.span[0]] + "".join(f"{line}\n" for line in lines) + text[block.span[1] :]
        (ROOT / name).write_text(text, encoding="utf-8")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.stem)
def test_example(path: Path, tmp_path: Path) -> None:
    tool = ["-m", "pytest", "-q", "-p", "no:cacheprovider"] if path.stem.startswith("test_") else []
    done = subprocess.run([sys.executable, *tool, str(path)], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)},
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0 and done.stdout.strip(), done.stdout + done.stderr


@pytest.mark.parametrize(("figure", "name"), [("fig01", "impulses_and_forces"), ("fig05", "couplings"),
                                              ("scenes", "scenes")])  # fmt: skip
def test_pictures_show_the_runs_of_today(figure: str, name: str, tmp_path: Path) -> None:
    """What they say of themselves in words and numbers, such as the forces at the contacts."""
    assert main(["reproduce", "--figure", figure, "--out", str(tmp_path)]) == 0
    assert not differs(described(tmp_path / f"{figure}.svg"), described(PICTURES / f"{name}.svg")), (
        f"draw it again: iapb reproduce --figure {figure}")


def test_the_picture_of_the_readme_shows_the_runs_of_today(tmp_path: Path) -> None:
    """What it says of itself in words: which world is nearest to the ideal one."""
    start, scene, drawn = Condition(), load_scene(find_scene("peg_corner")), tmp_path / "hero.svg"
    runs = {world: run_world(start.place(scene), world) for world in IGNORED}
    drawn.write_text(standalone(draw(hero, {TILTED: {start.tilt: runs}})), encoding="utf-8")
    assert not differs(described(drawn), described(PICTURES / "peg_in_the_corner.svg")), "draw it again"


def described(picture: Path) -> str:
    """Return what a picture says of itself."""
    return re.findall(r"<desc>(.*?)</desc>", picture.read_text(encoding="utf-8"), flags=re.S)[0]
