"""What importing costs and offers: the names are there, the heavy packages are not loaded."""

import os
import subprocess
import sys
import tomllib
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import iapb

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = ("iapb", "reference", "verification", "reports")
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


def test_what_packages_above_add_to_the_engine_is_there():
    offered = PROJECT["project"]["entry-points"]
    worlds = EntryPoint("reference", offered["iapb.worlds"]["reference"], "iapb.worlds").load()
    assert {"IAPB", "PB", "ideal", "CBuc"} <= set(worlds) and worlds is import_module(
        "iapb.worlds"
    ).WORLDS
    write = EntryPoint("write", offered["iapb.files"]["write"], "iapb.files").load()
    assert write is import_module("reports.store").write_run
