"""What importing costs and offers: the names are there, the heavy packages are not loaded."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from copy import deepcopy
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from grimp import build_graph
from importlinter.configuration import configure
from importlinter.contracts.forbidden import ForbiddenContract

import iapb

ROOT = Path(__file__).parents[1]
PACKAGES = ("iapb", "reference", "verification", "reports")
# Groups of modules that import each other, and imports of our own modules inside functions, which keep heavy libraries
# (numba, quantecon, typer) out of commands that need none of them. Both may only fall.
CYCLES, LATE_IMPORTS = 0, 6
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


@cache
def imports() -> dict[str, set[tuple[str, bool]]]:
    """Module -> (module of ours that it imports, whether inside a function); those for type checkers are left out."""
    files = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
             for package in PACKAGES for path in (ROOT / package).rglob("*.py")}  # fmt: skip
    return {name: set(_imported(ast.parse(path.read_text(encoding="utf-8")), set(files), False)) - {(name, True)}
            for name, path in files.items()}  # fmt: skip


def _imported(node: ast.AST, modules: set[str], late: bool) -> Iterator[tuple[str, bool]]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        if isinstance(child, ast.ImportFrom) and child.module:
            names = (f"{child.module}.{alias.name}" for alias in child.names)
            yield from ((name if name in modules else child.module, late) for name in names
                        if name in modules or child.module in modules)  # fmt: skip
        elif isinstance(child, ast.Import):
            yield from ((alias.name, late) for alias in child.names if alias.name in modules)
        yield from _imported(child, modules, late or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef))


def reached(graph: dict[str, set[str]], start: str) -> set[str]:
    """Modules that a module imports, directly or by others."""
    found: set[str] = set()
    waiting = list(graph[start])
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += graph[name]
    return found


def cycles(graph: dict[str, set[str]]) -> set[frozenset[str]]:
    """Groups of modules that import each other."""
    below = {name: reached(graph, name) for name in graph}
    return {frozenset(other for other in below[name] if name in below[other]) for name in graph if name in below[name]}


def test_no_modules_import_each_other_not_even_inside_functions() -> None:
    graph = {name: {other for other, _ in found} for name, found in imports().items()}
    found = sorted(sorted(group) for group in cycles(graph))
    assert len(found) <= CYCLES, found


def test_imports_inside_functions_are_few() -> None:
    late = sorted((name, other) for name, found in imports().items() for other, inside in found if inside)
    assert len(late) <= LATE_IMPORTS, late


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


def test_a_cycle_is_found() -> None:
    assert cycles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == {frozenset("abc")}
    tree = ast.parse("if TYPE_CHECKING:\n    import x\ndef f():\n    from x import y, z\nimport x.y")
    assert set(_imported(tree, {"x", "x.y"}, False)) == {("x.y", True), ("x", True), ("x.y", False)}


def test_what_packages_above_add_to_the_engine_is_there() -> None:
    from importlib.metadata import EntryPoint

    offered = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    worlds = EntryPoint("reference", offered["iapb.worlds"]["reference"], "iapb.worlds").load()
    assert {"IAPB", "PB", "ideal", "CBuc"} <= set(worlds) and worlds is import_module("iapb.worlds").WORLDS
    write = EntryPoint("write", offered["iapb.files"]["write"], "iapb.files").load()
    assert write is import_module("reports.store").write_run
