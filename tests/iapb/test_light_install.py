"""The engine works without the packages of the extras, and whoever lacks one reads which extra
brings it."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from iapb.errors import EXTRAS

ROOT = Path(__file__).resolve().parents[2]
IMPORTED_AS = {"pin": "pinocchio", "python-flint": "flint"}
WITHOUT = """
import sys
from importlib.abc import MetaPathFinder

class Missing(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {missing!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
"""


def run_without(missing: set[str], code: str) -> subprocess.CompletedProcess[str]:
    """Run code in a new interpreter in which these packages cannot be imported."""
    return subprocess.run(
        [sys.executable, "-c", WITHOUT.format(missing=missing) + code],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


def test_the_extras_of_the_messages_are_those_of_the_project() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    bring = {
        IMPORTED_AS.get(name, name): extra
        for extra in ("reference", "verify", "report", "all")
        for line in extras[extra]
        if not (name := line.partition(">")[0]).startswith("iapb")
    }
    assert bring == EXTRAS


WORKS = """
from iapb import find_scene, resolve_impact, simulate
print(simulate(find_scene("peg_corner"), steps=5).steps, resolve_impact([[1.0]], [[1.0]], [-1.0], 0.0).velocity)
"""
TOLD = "{} needs {}, which is not installed. Install it with: pip install '.[{}]' (in a checkout of iapb)"
NEEDS = [
    (
        "from iapb import simulate; simulate('peg_corner', world='ideal', steps=5)",
        "The world ideal",
        "numba",
    ),
    (
        "from iapb import simulate; simulate('peg_corner', steps=5).save('never.h5')",
        "Run.save",
        "h5py",
    ),
    (
        "from verification import check_passivity; check_passivity(lambda M, J, v, e: v)",
        "verification.check_passivity",
        "hypothesis",
    ),
    ("from iapb.__main__ import main; print(main())", "iapb: The command", "typer"),
]
COMMANDS = {
    "inspect run.h5": ("h5py", "reference", "The command"),
    "verify": ("hypothesis", "verify", "verification.check_passivity"),
    "reproduce": ("jinja2", "report", "The command"),
}


def test_simulate_and_resolve_need_no_extra_and_what_does_says_which_in_one_sentence() -> None:
    each = f"""
for code in {[code for code, *_ in NEEDS]!r}:
    try:
        exec(code)
    except Exception as error:
        print(error, file=sys.stderr)
"""
    done = run_without(set(EXTRAS), WORKS + each)
    assert done.stdout == "5 [0.]\n1\n", done.stderr
    assert done.stderr.splitlines() == [
        TOLD.format(who, package, EXTRAS[package]) for _, who, package in NEEDS
    ]


@pytest.mark.parametrize("line", COMMANDS)
def test_a_command_without_its_extra_ends_before_it_computes_and_names_it(line: str) -> None:
    package, extra, who = COMMANDS[line]
    done = run_without(
        {package}, f"from reports.cli import main; raise SystemExit(main({line.split()!r}))"
    )
    assert done.returncode == 1 and done.stdout == "", done
    assert done.stderr == "iapb: " + TOLD.format(who, package, extra) + "\n"


@pytest.mark.parametrize(("name", "own"), [("reference", "{}/__init__.py"), ("reports", "{}.py")])
def test_a_foreign_package_of_the_same_name_is_named(name: str, own: str, tmp_path: Path) -> None:
    file = tmp_path / own.format(name)
    file.parent.mkdir(exist_ok=True)
    file.touch()
    start = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); "
    foreign = file.parent if file.name == "__init__.py" else file
    for code in (
        "from iapb.__main__ import main; raise SystemExit(main())",
        "from iapb.lazy import needed; needed('verification.laws.kit', 'The fixture iapb_law')",
    ):
        done = run_without(set(), start + code)
        assert done.returncode == 1
        assert (
            f"{foreign} hides the package {ROOT / name}" in done.stderr
            and "Rename yours" in done.stderr
        )
