"""Files that other people made: they show no other file, hang nothing, run nothing, and order no terminal about."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from reference.datasets import DatasetError, read_problem
from reports.cli import Harmless, harmless, main
from reports.store import write_run
from reports.store.io import sealed
from tests.robustness.faults import sample_run
from tests.robustness.inputs import fclib_files

pytestmark = pytest.mark.thorough

SECRET = b"root:x:0:0:a line of a password file that nobody may see\n" * 4
ROOT = Path(__file__).parents[2]


def external_link(file: Any, other: Path) -> None:
    del file["scene/name"]
    file["scene/name"] = h5py.ExternalLink(str(other), "/secret")


def soft_link(file: Any, other: Path) -> None:
    del file["scene/name"]
    file["scene/name"] = h5py.SoftLink("/law/name")


def linked_group(file: Any, other: Path) -> None:
    file.move("scene", "kept")
    file["scene"] = h5py.ExternalLink(str(other), "/")


def external_storage(file: Any, other: Path) -> None:
    del file["trajectory/q"]
    flat = other.with_suffix(".txt")
    file.create_dataset("trajectory/q", (len(SECRET),), "u1", external=[(str(flat), 0, len(SECRET))])


def virtual(file: Any, other: Path) -> None:
    del file["trajectory/q"]
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "numbers", shape=(3,))
    file.create_virtual_dataset("trajectory/q", layout)


ATTACKS = {external_link: "link to another file", soft_link: "soft link", linked_group: "link to another file",
           external_storage: "stored in another file", virtual: "put together"}  # fmt: skip


@pytest.fixture
def other(tmp_path: Path) -> Path:
    """Another file of the reader's, which a run file may not show: as text and as HDF5."""
    path = tmp_path / "private.h5"
    path.with_suffix(".txt").write_bytes(SECRET)
    with h5py.File(path, "w") as file:
        file["secret"], file["numbers"] = SECRET.decode(), np.arange(3.0)
    return path


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_a_run_file_shows_no_other_file(
    attack: Callable[[Any, Path], None], other: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_run(tmp_path / "run.h5", sample_run())
    with h5py.File(path, "r+") as file:
        attack(file, other)
    path.write_bytes(sealed(path.read_bytes()))
    for words in (["inspect", path], ["verify", "--recheck", path], ["store", "again", path]):
        assert main([str(word) for word in words]) == 1
        said = "".join(capsys.readouterr())
        assert ATTACKS[attack] in said and "password" not in said, said


def test_a_problem_file_shows_no_other_file(other: Path, tmp_path: Path) -> None:
    path = tmp_path / "local.hdf5"
    path.write_bytes(fclib_files()["local.hdf5"])
    with h5py.File(path, "r+") as file:
        del file["fclib_local/info/title"]
        file["fclib_local/info/title"] = h5py.ExternalLink(str(other), "/secret")
    with pytest.raises(DatasetError, match="info/title is a link to another file"):
        read_problem(path)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    """Each reader in a process of its own, which must end."""
    os.mkfifo(tmp_path / "pipe.h5")
    os.mkfifo(tmp_path / "arm.urdf")
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "scene.yaml").write_text(
        "{name: s, dimensions: 3, rate: 100, duration: 1, bodies: [], robots: [{name: a, urdf: arm.urdf}]}"
    )
    lines = (["inspect", "pipe.h5"], ["store", "check", "pipe.h5"], ["store", "again", "pipe.h5"],
             ["verify", "--recheck", "pipe.h5"], ["run", "scene.yaml"], ["run", "pipe.yaml"], ["sweep", "pipe.yaml"],
             ["report", "diff", "pipe.h5", "pipe.h5"])  # fmt: skip
    for words in lines:
        done = subprocess.run([sys.executable, "-m", "reports.cli", *words], cwd=tmp_path, capture_output=True,
                              timeout=120, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)})  # fmt: skip
        assert done.returncode == 1 and done.stderr.count("\n") <= 3, (words, done.stderr)


ORDERS = "\x1b]0;owned\x07\x1b[2J\x9b31m\rfake\x08\u202eevil"


def test_no_text_of_a_file_gives_the_terminal_orders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    evil = {"commit": ORDERS, ORDERS: "a name"}
    path = write_run(tmp_path / f"{ORDERS.replace('/', '')}.h5", sample_run(), provenance=evil)
    assert main(["inspect", str(path)]) == 0
    path.write_bytes(b"no run")
    assert main(["inspect", str(path)]) == 1 and main(["store", "check", str(path)]) == 1
    said = "".join(capsys.readouterr())
    assert not set(ORDERS) & set(said) - set("]0;owned[2J31mfakeevil")
    assert "\\x1b]0;owned\\x07" in said


def test_a_terminal_gets_colours_and_nothing_else_that_it_obeys() -> None:
    stream = io.StringIO()
    stream.isatty = lambda: True  # type: ignore[method-assign]
    Harmless(stream, re.compile(r"(\x1b\[[0-9;]*m)")).write(f"\x1b[1;31mred\x1b[0m\n{ORDERS}")
    assert stream.getvalue() == f"\x1b[1;31mred\x1b[0m\n{harmless(ORDERS)}"
    assert harmless("tab\tand\nend") == "tab\tand\nend"


def test_without_a_folder_for_the_cache_kernels_are_compiled_in_memory_and_it_is_said() -> None:
    program = ("import numba.core.caching as c; c.CacheImpl._locator_classes = []\n"
               "import numpy as np; from iapb.compiled import copy_into\n"
               "a = np.zeros(3); copy_into(a, np.ones(3)); print(a.sum())")  # fmt: skip
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "3.0" and done.stderr.count("UserWarning: kernels are compiled anew") == 1
