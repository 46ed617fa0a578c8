"""What is damaged, and who reads it: `KINDS` by name, with valid samples of each kind.

Command lines are an input, too: words of valid ones lost, doubled, exchanged and damaged, then run in this process.
Only commands that end soon are run; a line that would start longer work (`verify`, `prove` …) has a wrong word in it.
"""

from __future__ import annotations

import contextlib
import gzip
import io
import json
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from iapb import decide_effects, load_scene, simulate
from iapb.errors import IapbError, RunFileError
from iapb.mechanics.urdf import read_collisions, read_urdf
from iapb.scene import scene_folder
from iapb.scene.document import Document
from reference.complementarity.problem import ImpactProblem
from reference.datasets import _write_rows, read_problem, write_fclib
from reports.cli import main
from reports.commands.inspect import inspect
from reports.store.io import sealed
from reports.store.tables import read_table, write_table
from reports.sweeps.study import load_study, points_of, scene_of
from tests.robustness.damage import TOKENS, Rng, changes, chosen, damaged_bytes, damaged_text, damaged_values
from tests.robustness.faults import put
from verification.table import titled

TIMES = int(os.environ.get("IAPB_FUZZ", "1"))  # how often each fault is done, and a multiple of the wrong inputs
_STEPS = 3  # of a scene that is read all the same: it must also start


@dataclass(frozen=True)
class Kind:
    """One kind of input.

    samples : valid inputs, as bytes, by file name
    damaged : (sample, another sample, rng) -> wrong input
    read : reads a file; ends without a word, or raises an IapbError
    cases : how many are tried: fewer where a case takes long
    """

    name: str
    samples: Callable[[], dict[str, bytes]]
    damaged: Callable[[bytes, bytes, Rng], bytes]
    read: Callable[[Path], Any]
    cases: int = 200


def prepare(folder: Path) -> None:
    """Put beside the cases what they may refer to: the robots of the scenes."""
    shutil.copytree(scene_folder() / "robots", folder / "robots", dirs_exist_ok=True)


def _as_text(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Texts as texts; what is compressed, as bytes."""
    if sample[:2] == b"\x1f\x8b":
        return damaged_bytes(sample, rng)
    return damaged_text(sample.decode(), rng, "" if other[:2] == b"\x1f\x8b" else other.decode())


def _as_values(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Half of the cases are damaged as values: they are always YAML, and get past the first look."""
    if rng.random() < 0.5:
        return _as_text(sample, other, rng)
    return json.dumps(damaged_values(_plain(sample), rng)).encode()


@cache
def _plain(sample: bytes) -> Any:
    return Document(sample.decode()).value


def _as_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return damaged_bytes(sample, rng)


def _shipped(pattern: str) -> Callable[[], dict[str, bytes]]:
    """Return the files of the scenes' folder, read once."""
    return cache(lambda: {path.name: path.read_bytes() for path in sorted(scene_folder().glob(pattern))})


def _read_scene(path: Path) -> None:
    """What every command does with a scene: read it, decide its effects, start it."""
    scene = load_scene(path)
    decide_effects(scene)
    simulate(scene, steps=min(_STEPS, scene.steps))


def _read_study(path: Path) -> None:
    """Read it, find its scene, and spell out its first points."""
    study = load_study(path)
    list(islice(points_of(study, str(scene_of(study, path))), _STEPS))


def _read_robot(path: Path) -> None:
    read_urdf(path)
    read_collisions(path)


def _read_results(path: Path) -> None:
    """A run file, or a table: as `iapb inspect` and the report read it."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            inspect(path, 3)
    except RunFileError:
        read_table(path, "sample")


_LCP = "2\n2 1\n1 2\n-5 -6\n"
_SICONOS = "3\n0\n3\n3\n3\n3\n1 0 0\n2 1 0\n2 2 1\n-8 -6 -4\nexample of Fathi\n"
_MLCP = """\
# two contacts
numDof = 6
constraint types = MLCP_UNILATERAL_3D_FRICTIONLESS_CONSTRAINT MLCP_UNILATERAL_3D_FRICTIONLESS_CONSTRAINT
E = ((-1) (-2))
HCHt = ((2 1)
        (1 2))
mu = (0 0)
lambda = ((0) (1))
== END ==
"""


def problem_texts() -> dict[str, bytes]:
    """One small problem of each text format."""
    texts = {"two.lcp": _LCP, "fathi.dat": _SICONOS, "contacts.txt": _MLCP}
    return {name: text.encode() for name, text in texts.items()} | {"two.lcp.gz": gzip.compress(_LCP.encode(), mtime=0)}


@cache
def fclib_files() -> dict[str, bytes]:
    """A local and a global problem with friction."""
    rng = np.random.default_rng(0)
    problem = ImpactProblem.from_impact(np.eye(6), rng.normal(size=(6, 6)), rng.normal(size=6), 0.0, [0.3, 0.5])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "local.hdf5"
        write_fclib(path, problem, "sample", np.ones(6))
        _write_global(path.with_name("global.hdf5"), rng)
        return {each.name: each.read_bytes() for each in sorted(path.parent.iterdir())}


def _write_global(path: Path, rng: Rng) -> None:
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_global")
        _write_rows(group.create_group("M"), np.eye(6))
        _write_rows(group.create_group("H"), rng.normal(size=(6, 3)))
        group["vectors/f"], group["vectors/w"], group["vectors/mu"] = np.ones(6), np.zeros(3), np.array([0.3])
        group["spacedim"] = np.array([3], np.int32)
        group["info/title"] = np.bytes_("sample")


@cache
def result_files() -> dict[str, bytes]:
    """A short run, and a table."""
    with tempfile.TemporaryDirectory() as folder:
        run, table = put(Path(folder)), Path(folder) / "table.h5"
        write_table(table, "sample", titled(("x [m]", "word"), [(0.5, "a"), (1.5, "b")]))
        return {"run.h5": run.read_bytes(), "table.h5": table.read_bytes()}



def damaged_hdf5(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Damage to the bytes, or to what the file says: parts lost, renamed, of another shape or type."""
    return damaged_bytes(sample, rng) if rng.random() < 0.3 else _changed(sample, rng)


def damaged_hdf5_sealed(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Damage to what the file says, under a seal that is right: somebody else's program wrote it."""
    return sealed(_changed(sample, rng))


def _changed(content: bytes, rng: Rng) -> bytes:
    stream = io.BytesIO(content)
    with h5py.File(stream, "r+") as file:
        names: list[str] = []
        file.visit(names.append)
        for _ in changes(rng):
            if (name := chosen(rng, names)) in file:
                _change(file, name, rng)
    return stream.getvalue()


def _change(file: Any, name: str, rng: Rng) -> None:
    kind, wrong = int(rng.integers(5)), chosen(rng, _WRONG)
    owner = file[name] if rng.random() < 0.5 else file
    if kind == 0 and len(owner.attrs):
        attribute = chosen(rng, sorted(owner.attrs))
        if rng.random() < 0.5 or not isinstance(wrong, np.ndarray):
            del owner.attrs[attribute]
        else:
            owner.attrs[attribute] = wrong
        return
    if kind == 1:
        file.move(name, f"{name}_")
        return
    del file[name]
    if kind == 2:
        file.create_group(name)
    elif isinstance(wrong, tuple):  # stated to be large, never written: a few bytes on the disk
        file.create_dataset(name, shape=wrong, dtype=np.float64, chunks=(1024,) * len(wrong))
    elif kind >= 3:
        file[name] = wrong


_WRONG: tuple[Any, ...] = (
    np.zeros(0), np.zeros(3), np.array([-1], np.int32), np.array([2**31 - 1], np.int64), np.array([1e308, np.nan]),
    np.array([[1.0, 2.0], [3.0, 4.0]]), np.bytes_("word"), "text \u00e9", np.array([0, 7, -3], np.int32), (2**40,),
    (2**20, 2**20), np.array([3], np.int32), np.array([-2], np.int32), np.array([1 + 2j]), np.float64(0.5),
    np.array([True]),
)  # fmt: skip


_LINES = (
    "run peg_corner --set duration=0.05",
    "run two_discs --world PB --set duration=0.05 --set contact.restitution=0.5",
    "run peg_corner --rendering scale --set duration=0.05 --set bodies.peg.position=[0.03,-0.01,0]",
    "effects peg_corner --world ideal", "effects arm_obstacles", "inspect run.h5 --impacts 1", "schema",
    "store check results", "store gc results", "sweep no_study --workers 1", "verify --recheck run.h5",
    "reproduce --figure fig99",
)  # fmt: skip
_LONG = ("verify", "prove", "reproduce", "compare", "bench")
_DEBUG = "--debug"  # shows a traceback, as it is asked to
_WORDS = (
    "--world", "--set", "--out", "--rendering", "--", "-", "--help", "run", "effects", "inspect", "schema", "store",
    "CBuc", "ideal", "peg_room", "wall_1d", ".", "/", "a=b", "=", "duration=0.01", "rate=1e999", "bodies.peg.mass=0",
    "walls=[]", "bodies=[]", "couplings=~", "hand=", "bodies.9.mass=1", "contact..x=1", "name=..", "-1", "--impacts",
    "run.h5", "table.h5", "results", "", "contact.friction=0.3", "check", "gc",
)  # fmt: skip


class LineError(Exception):
    """A command line ended in a way that none may: another status, no message, a traceback in the text."""


def lines() -> dict[str, bytes]:
    """The valid lines, as JSON lists of words."""
    return {f"{number:02d}.json": json.dumps(line.split()).encode() for number, line in enumerate(_LINES)}


def damaged_line(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Return a line with words changed, as JSON."""
    words = json.loads(sample)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        at, known = int(rng.integers(len(words) + 1)), str(chosen(rng, _WORDS if rng.random() < 0.7 else TOKENS))
        cut = words[at][: int(rng.integers(1 + len(words[at])))] if at < len(words) else ""
        after = words[at + 1 :]
        words = words[:at] + chosen(rng, [[known, *words[at:]], [known, *after], after, [cut + known, *after],
                                          [*words[at:], *json.loads(other)[1:]]])  # fmt: skip
    return json.dumps(words).encode()


def run_line(path: Path) -> None:
    """Run a line where the files it may name are; it must end with 0, 1 or 2, and say why where it is not 0.

    Raises
    ------
    IapbError
        With the message, where the line was refused as it should be.
    LineError
        Where it ended in another way.
    """
    words = [word for word in json.loads(path.read_bytes()) if word != _DEBUG]
    words += ["--no-such-option"] if set(words) & set(_LONG) else []  # what might start long work
    for place in (path.parent, path.parent / "results"):
        place.mkdir(exist_ok=True)
        for name, content in result_files().items():
            (place / name).write_bytes(content)
    out, error, before = io.StringIO(), io.StringIO(), Path.cwd()
    os.chdir(path.parent)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = main(words)
    finally:
        os.chdir(before)
    said, complained = out.getvalue().strip(), error.getvalue().strip()
    if status not in (0, 1, 2) or "Traceback" in complained or (status and not (said or complained)):
        raise LineError(f"{words}: ended with {status}: {complained}")
    if status:
        raise IapbError(complained)


KINDS = {kind.name: kind for kind in (
    Kind("scenes", _shipped("*.yaml"), _as_values, _read_scene, 300),
    Kind("URDF robots", _shipped("robots/*.urdf"), _as_text, _read_robot),
    Kind("sweep studies", _shipped("sweeps/*.yaml"), _as_values, _read_study),
    Kind("LCP and MLCP files", problem_texts, _as_text, read_problem),
    Kind("FCLIB files", fclib_files, damaged_hdf5, read_problem),
    Kind("run files and tables", result_files, _as_bytes, _read_results),
    Kind("sealed run files", result_files, damaged_hdf5_sealed, _read_results, 60),
    Kind("command lines", lines, damaged_line, run_line, 60),
)}  # fmt: skip
