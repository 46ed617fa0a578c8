"""The library is made from the files beside it, for this platform; another one is never loaded."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import iapb.run
from iapb.numerics.library import PATH, manifest_of, sources, stamp

ENGINE = Path(iapb.run.__file__).parent
FIRST = "import iapb; print(iapb.resolve_impact([[1.0]], [[1.0]], [-1.0], 0.5).velocity[0])"


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """The engine as an installed package: without the project around it."""
    ignored = shutil.ignore_patterns("__pycache__", "*.lock")
    return Path(shutil.copytree(ENGINE, tmp_path / "iapb", ignore=ignored))


def resolve_with(package: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(package.parent)}
    return subprocess.run(
        [sys.executable, "-P", "-c", FIRST], capture_output=True, text=True, env=environment
    )


def test_an_installed_library_is_used_as_it_is(installed: Path) -> None:
    assert resolve_with(installed).stdout == "0.5\n"


def changed_source(package: Path) -> None:
    kernels = package / "numerics" / "linalg.py"
    kernels.write_text(kernels.read_text().replace("+", "-", 1))


def other_platform(package: Path) -> None:
    library = package / PATH.name
    library.write_bytes(library.read_bytes().replace(sys.platform.encode(), b"amiga"))


def missing(package: Path) -> None:
    (package / PATH.name).unlink()


def truncated(package: Path) -> None:
    library = package / PATH.name
    library.write_bytes(library.read_bytes()[:1000])


@pytest.mark.parametrize("spoil", [changed_source, other_platform, missing, truncated])
def test_a_library_that_does_not_fit_is_refused_in_one_sentence(installed: Path, spoil) -> None:
    spoil(installed)
    done = resolve_with(installed)
    assert done.returncode == 1 and "IapbError" in done.stderr
    assert "install iapb again" in done.stderr.splitlines()[-1]


def test_the_library_beside_the_engine_is_that_of_its_files() -> None:
    assert manifest_of(PATH)["stamp"] == stamp()


def test_the_stamp_covers_every_file_whose_constants_kernels_read() -> None:
    """Else a changed constant would leave the machine code made with the old one in use."""
    stamped = set(sources())
    assert stamped >= {
        ENGINE / name
        for name in (
            "contact/geometry.py",
            "run.py",
            "building/bitcode.py",
            "building/engine.py",
            "numerics/library.py",
        )
    }
    kernels = [path for path in stamped if b"@kernel" in path.read_bytes()]
    for path in kernels:
        for node in ast.walk(ast.parse(path.read_text())):
            module = str(getattr(node, "module", ""))
            if not (isinstance(node, ast.ImportFrom) and module.startswith("iapb")):
                continue
            constants = [each.name for each in node.names if each.name.lstrip("_").isupper()]
            home = ENGINE.parent.joinpath(*module.split(".")).with_suffix(".py")
            assert home in stamped or not constants, (path, constants)
