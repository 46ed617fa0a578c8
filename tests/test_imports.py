"""What importing costs and offers: the names are there, the heavy packages are not loaded."""

import ast
import os
import subprocess
import sys
import tomllib
from copy import deepcopy
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from grimp import build_graph
from importlinter.configuration import configure
from importlinter.contracts.forbidden import ForbiddenContract

import iapb

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = ("iapb", "reference", "verification", "reports")
# Imports of our own modules inside functions, which keep heavy libraries (numba, quantecon, typer)
# out of commands that need none of them. Their number may only fall.
LATE_IMPORTS = 6
HEAVY = {
    "pinocchio",
    "coal",
    "cvxpy",
    "sympy",
    "flint",
    "matplotlib",
    "h5py",
    "numba",
    "scipy",
    "viser",
    "quantecon",
}


def test_every_public_name_is_there_and_an_unknown_one_is_an_attribute_error():
    for name in iapb.__all__:
        assert callable(getattr(iapb, name)) or name == "__version__", name
        assert name == "__version__" or name in dir(iapb), name
    with pytest.raises(AttributeError, match="nonsense"):
        _ = iapb.nonsense
    assert PROJECT["project"]["version"] == iapb.__version__


@pytest.mark.parametrize(
    ("statement", "heavy"),
    [
        ("import iapb", HEAVY | {"numpy"}),
        ("import reports.store, reports.provenance", HEAVY),
        ("from reports.cli import main; main(['--help'])", HEAVY | {"numpy", "hypothesis"}),
        (
            "from reports.cli import main; main(['run', 'peg_corner', '--set', 'duration=0.1'])",
            {"verification", "reference.complementarity"},
        ),
    ],
)
def test_importing_is_cheap(statement, heavy, tmp_path):
    program = f"{statement}\nimport sys\nprint('LOADED', *sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert not set(done.stdout.partition("LOADED")[2].split()) & heavy


def test_the_scenes_are_found_and_the_packages_carry_their_types():
    for name in import_module("iapb.scene").scene_names():
        assert iapb.find_scene(name).is_file() and iapb.find_scene(
            f"{name}.yaml"
        ) == iapb.find_scene(name)
    with pytest.raises(iapb.ArgumentError, match="one of"):
        iapb.find_scene("no such scene")
    assert all((ROOT / package / "py.typed").is_file() for package in PACKAGES)


def test_no_modules_import_each_other_and_imports_inside_functions_are_few():
    found = build_graph(*PACKAGES, exclude_type_checking_imports=True)
    TopologicalSorter(
        {name: found.find_modules_directly_imported_by(name) for name in found.modules}
    ).prepare()
    found.add_import(importer="iapb.errors", imported="reports.cli")
    with pytest.raises(CycleError):
        TopologicalSorter(
            {name: found.find_modules_directly_imported_by(name) for name in found.modules}
        ).prepare()
    late = {
        (path.name, part.module)
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(function, ast.FunctionDef)
        for part in ast.walk(function)
        if isinstance(part, ast.ImportFrom) and str(part.module).partition(".")[0] in PACKAGES
    }
    assert len(late) <= LATE_IMPORTS, late


def test_a_reference_that_calls_the_engine_breaks_the_contract():
    configure()
    settings = deepcopy(PROJECT["tool"]["importlinter"])
    given = next(each for each in settings.pop("contracts") if each["type"] == "forbidden")
    options = {
        key: str(value) if isinstance(value, bool) else value for key, value in given.items()
    }
    contract = ForbiddenContract(given["name"], settings, options)
    graph = build_graph(*PACKAGES, include_external_packages=True)
    assert contract.check(deepcopy(graph), verbose=False).kept
    for engine in (
        "iapb.contact.kernels.step",
        "iapb.mechanics.kernels.dynamics",
        "iapb.contact.impact",
    ):
        broken = deepcopy(graph)
        broken.add_import(importer="reference.rigid_step", imported=engine)
        assert not contract.check(broken, verbose=False).kept, engine


def test_what_packages_above_add_to_the_engine_is_there():
    offered = PROJECT["project"]["entry-points"]
    worlds = EntryPoint("reference", offered["iapb.worlds"]["reference"], "iapb.worlds").load()
    assert {"IAPB", "PB", "ideal", "CBuc"} <= set(worlds) and worlds is import_module(
        "iapb.worlds"
    ).WORLDS
    write = EntryPoint("write", offered["iapb.files"]["write"], "iapb.files").load()
    assert write is import_module("reports.store").write_run
