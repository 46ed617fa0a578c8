"""What importing costs and offers: the names are there, the heavy packages are not loaded."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import iapb

ROOT = Path(__file__).parents[1]
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
