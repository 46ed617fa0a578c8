"""Every block of the documents is performed, and every example; what they show is what comes out.

Words must be equal, numbers up to what another machine may change; "…" in a document stands for
anything. `IAPB_UPDATE_DOCS=1 pytest -m '' tests/docs` writes today's outputs into the documents;
shortened ones stay.
"""

import contextlib
import json
import math
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # importmode=importlib does not

from performing import ROOT, read_blocks

DOCUMENTS = (
    "README.md",
    *(
        pytest.param(f"docs/{name}.md", marks=pytest.mark.thorough)
        for name in (
            "tutorial",
            "scenes",
            "resolvers",
            "certificate",
            "haptic_loop",
            "report",
            "questions",
        )
    ),
)
WIDTH = "100"  # of the terminal that the documents show
RELATIVE = 1e-3  # documents print a few digits
ROUNDING = 1e-6  # numbers below it are rounding noise, which differs from machine to machine
COMPILING = re.compile(r"Compiling (kernels .*|took .* s\.)")  # a fresh checkout says it
HASH = re.compile(r"\b[0-9a-f]{16}(?:[0-9a-f]{48})?\b")
TIME = re.compile(r"(?<![\w.])[\d.]+(?:e[-+]?\d+)? (?:s|ms|µs)\b")
MEASURED = (
    "computed in",
    "it had taken",
    "seconds",
    "proved",
    "passed in",
    "failed in",
    " in 0.",
    "refuted",
)
NUMBER = re.compile(r"(?<![\w.])([-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?)")


def differs(printed, expected):
    """Return the first difference in words, or an empty text."""
    given = lines_of(printed)
    gap = not lines_of(expected)
    for wanted in lines_of(expected):
        if wanted == "…":  # any lines: go on at the next line that fits
            gap = True
            continue
        while given and gap and not fits(given[0], wanted):
            given.pop(0)
        if not given:
            return f"the document goes on with {wanted!r}, the program ends"
        if not fits(given[0], wanted):
            return f"the document says {wanted!r}, the program {given[0]!r}"
        given.pop(0)
        gap = False
    return f"the program goes on with {given[0]!r}" if given and not gap else ""


def lines_of(text):
    """Lines that are not empty, with what the machine decides masked or left out, and spaces
    joined."""
    lines = []
    for line in text.splitlines():
        if any(word in line for word in MEASURED):
            line = TIME.sub("TIME", line)
        words = [] if COMPILING.fullmatch(line) else HASH.sub("HASH", line).split()
        lines += [" ".join(words)] if words else []
    return lines


def fits(given, wanted):
    if "…" in wanted:
        return re.fullmatch(".*".join(map(re.escape, wanted.split("…"))), given) is not None
    one = NUMBER.split(given)
    other = NUMBER.split(wanted)
    return (
        len(one) == len(other) and one[::2] == other[::2] and all(map(same, one[1::2], other[1::2]))
    )


def same(a, b):
    whole = not set(".e") & set(a + b)
    return a == b if whole else math.isclose(float(a), float(b), rel_tol=RELATIVE, abs_tol=ROUNDING)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_document(name, tmp_path):
    work = tmp_path / "work"
    told = tmp_path / "answers.json"
    work.mkdir()
    environment = {
        **os.environ,
        "PYTHONPATH": f"{work}{os.pathsep}{ROOT}",
        "PYTHONDONTWRITEBYTECODE": "1",
        "COLUMNS": WIDTH,
        "TERM": "dumb",
        "NO_COLOR": "1",
    }
    for variable in (
        "CI",
        "BUILD_NUMBER",
        "PYTEST_ADDOPTS",
    ):  # where these are set, pytest prints more
        environment.pop(variable, None)
    done = subprocess.run(
        [sys.executable, str(Path(__file__).parent / "performing.py"), name, str(told)],
        cwd=work,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    makefile = (ROOT / "Makefile").read_text()
    pairs = list(zip(read_blocks(name), json.loads(told.read_text()), strict=True))
    wrong = []
    for block, answer in pairs:
        difference = "" if block.expected is None else differs(answer["output"], block.expected)
        if answer["failure"] or difference and not os.environ.get("IAPB_UPDATE_DOCS"):
            wrong.append(f"{block.id}: {answer['failure'] or difference}\n\n{answer['output']}")
        targets = re.findall(r"^make (\w+)", block.source, flags=re.M) if block.kind == "sh" else []
        wrong += [
            f"{block.id}: no make target {target!r}"
            for target in targets
            if f"\n{target}:" not in makefile
        ]
    if os.environ.get("IAPB_UPDATE_DOCS"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for block, answer in reversed(pairs):
            if block.expected is not None and "…" not in block.expected:
                lines = [line.rstrip() for line in answer["output"].strip("\n").splitlines()]
                text = (
                    text[: block.span[0]]
                    + "".join(f"{line}\n" for line in lines)
                    + text[block.span[1] :]
                )
        (ROOT / name).write_text(text, encoding="utf-8")
    assert not wrong, "\n".join(wrong)


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A folder whose runs examples and pictures share."""
    return tmp_path_factory.mktemp("shared")


SLOW = {"compare_worlds": pytest.mark.thorough, "figure_of_the_paper": pytest.mark.thorough}


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=SLOW.get(path.stem, ()))
        for path in sorted((ROOT / "examples").glob("*.py"))
    ],
)
def test_example(path, shared, capfd):
    with contextlib.chdir(shared):
        if path.stem.startswith("test_"):
            assert pytest.main(["-q", "-p", "no:cacheprovider", "-p", "no:xdist", str(path)]) == 0
        else:
            runpy.run_path(str(path), run_name="__main__")
    assert capfd.readouterr().out.strip()


@pytest.mark.thorough
@pytest.mark.parametrize(
    "path", sorted((ROOT / "examples/extending").glob("*.py")), ids=lambda path: path.stem
)
def test_extension(path, tmp_path):
    """It adds itself to the project, in a process of its own, and prints what its text says."""
    says = path.read_text(encoding="utf-8").split("Prints:\n")[1].partition('"""')[0]
    done = subprocess.run([sys.executable, path], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not differs(done.stdout, says)
