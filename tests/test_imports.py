"""What importing costs and offers: the names are there, the heavy packages are not loaded."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from copy import deepcopy
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest
from grimp import build_graph
from importlinter.configuration import configure
from importlinter.contracts.forbidden import ForbiddenContract

import iapb

ROOT = Path(__file__).parents[1]
PACKAGES = ("iapb", "reference", "verification", "reports")
# Imports of our own modules inside functions, which keep heavy libraries (numba, quantecon, typer) out of commands that
# need none of them. Their number may only fall.
LATE_IMPORTS = 6
HEAVY = ("pinocchio", "coal", "cvxpy", "sympy", "flint", "matplotlib", "h5py", "numba", "scipy", "viser", "quantecon")


def modules_after(statement: str) -> set[str]:
    """Return the modules loaded by a statement in a fresh interpreter."""
    program = f"{statement}\nimport sys\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(done.stdout.split())


@pytest.mark.parametrize("name", [name for name in iapb.__all__ if name != "__version__"])
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(iapb, name).__module__ in {"iapb.errors", iapb._MODULE_OF[name]} or callable(getattr(iapb, name))
    assert name in dir(iapb)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nonsense"):
        _ = iapb.nonsense


def test_version_is_that_of_the_package() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'version = "{iapb.__version__}"' in text


def test_importing_the_package_is_cheap() -> None:
    loaded = modules_after("import iapb")
    assert not loaded & {*HEAVY, "numpy"}


def test_the_store_waits_with_the_heavy_packages() -> None:
    loaded = modules_after("import reports.store, reports.provenance")
    assert not loaded & set(HEAVY)


def test_the_scenes_are_found() -> None:
    for name in import_module("iapb.scene").scene_names():
        assert iapb.find_scene(name).is_file() and iapb.find_scene(f"{name}.yaml") == iapb.find_scene(name)
    with pytest.raises(iapb.ArgumentError, match="one of"):
        iapb.find_scene("no such scene")


@pytest.mark.parametrize("package", ["iapb", "reference", "verification", "reports"])
def test_the_packages_carry_their_types(package: str) -> None:
    assert (ROOT / package / "py.typed").is_file()


def test_no_modules_import_each_other_not_even_inside_functions() -> None:
    found = build_graph(*PACKAGES, exclude_type_checking_imports=True)
    TopologicalSorter({name: found.find_modules_directly_imported_by(name) for name in found.modules}).prepare()
    found.add_import(importer="iapb.errors", imported="reports.cli")
    with pytest.raises(CycleError):
        TopologicalSorter({name: found.find_modules_directly_imported_by(name) for name in found.modules}).prepare()


def test_imports_inside_functions_are_few() -> None:
    late = [(path.name, part.module) for package in PACKAGES for path in (ROOT / package).rglob("*.py")
            for function in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(function, ast.FunctionDef) for part in ast.walk(function)
            if isinstance(part, ast.ImportFrom) and str(part.module).partition(".")[0] in PACKAGES]  # fmt: skip
    assert len(set(late)) <= LATE_IMPORTS, late


@pytest.mark.parametrize(
    "engine", ["iapb.contact.kernels.step", "iapb.mechanics.kernels.dynamics", "iapb.contact.impact"]
)
def test_a_reference_that_calls_the_engine_breaks_the_contract(engine: str) -> None:
    configure()
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    given = next(each for each in settings.pop("contracts") if each["type"] == "forbidden")
    options = {key: str(value) if isinstance(value, bool) else value for key, value in given.items()}
    contract = ForbiddenContract(given["name"], settings, options)
    graph = build_graph(*PACKAGES, include_external_packages=True)
    assert contract.check(deepcopy(graph), verbose=False).kept
    graph.add_import(importer="reference.rigid_step", imported=engine)
    assert not contract.check(graph, verbose=False).kept


def test_what_packages_above_add_to_the_engine_is_there() -> None:
    from importlib.metadata import EntryPoint

    offered = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    worlds = EntryPoint("reference", offered["iapb.worlds"]["reference"], "iapb.worlds").load()
    assert {"IAPB", "PB", "ideal", "CBuc"} <= set(worlds) and worlds is import_module("iapb.worlds").WORLDS
    write = EntryPoint("write", offered["iapb.files"]["write"], "iapb.files").load()
    assert write is import_module("reports.store").write_run
