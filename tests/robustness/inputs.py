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
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from iapb import decide_effects, load_scene, simulate
from iapb.errors import IapbError, RunFileError
from iapb.mechanics.urdf import read_collisions, read_urdf
from iapb.recording import Recorder
from iapb.scene import Scene, find_scene, scene_folder
from iapb.scene.document import Document
from iapb.simulation import Simulation
from reference.complementarity.problem import ImpactProblem
from reference.datasets import _write_rows, read_problem, write_fclib
from reference.worlds import find_world
from reports.cli import main
from reports.commands.inspect import inspect
from reports.live.deadline import TICK_COLUMNS
from reports.live.replay import finish_live, is_live, open_log
from reports.store.folder import Place
from reports.store.io import sealed
from reports.store.keys import content_hash
from reports.store.logs import RunLog, read_log
from reports.store.runs import read_entry
from reports.store.tables import Column, Table, read_table, write_table
from reports.streaming import log_head, recover, stream
from reports.sweeps.study import load_study, points_of, scene_of
from tests.robustness.damage import TOKENS, Rng, damaged_bytes, damaged_text, damaged_values
from tests.robustness.faults import inputs_of, open_store, sample_run

_STEPS = 3  # of a scene that is read all the same: it must also start


@dataclass(frozen=True)
class Kind:
    """One kind of input.

    samples : valid inputs, as bytes, by file name
    damaged : (sample, another sample, rng) -> wrong input
    read : reads a file; ends without a word, or raises an IapbError
    share : of the cases, beside the other kinds: less where a case takes long
    """

    name: str
    samples: Callable[[], dict[str, bytes]]
    damaged: Callable[[bytes, bytes, Rng], bytes]
    read: Callable[[Path], None]
    share: float = 1.0


def prepare(folder: Path) -> None:
    """Put beside the cases what they may refer to: the robots of the scenes."""
    shutil.copytree(scene_folder() / "robots", folder / "robots", dirs_exist_ok=True)


def _text_or_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return damaged_text(sample.decode(), rng, other.decode())


def _scene_or_text(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Half of the cases are damaged as values: they are always YAML, and get past the first look."""
    if rng.random() < 0.5:
        return _text_or_bytes(sample, other, rng)
    return json.dumps(damaged_values(_plain(sample), rng)).encode()


@cache
def _plain(sample: bytes) -> Any:
    return Document(sample.decode()).value


def _only_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return damaged_bytes(sample, rng)


@cache
def _scene_texts() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(scene_folder().glob("*.yaml"))}


def _planar() -> dict[str, bytes]:
    return {name: text for name, text in _scene_texts().items() if b"\ndimensions: 3" not in text}


def _spatial() -> dict[str, bytes]:
    return {name: text for name, text in _scene_texts().items() if b"\ndimensions: 3" in text}


def _read_scene(path: Path) -> None:
    """What every command does with a scene: read it, decide its effects, start it."""
    scene = load_scene(path)
    decide_effects(scene)
    simulate(scene, steps=min(_STEPS, scene.steps))


def _studies() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((scene_folder() / "sweeps").glob("*.yaml"))}


def _read_study(path: Path) -> None:
    """Read it, find its scene, and spell out its first points."""
    study = load_study(path)
    list(islice(points_of(study, str(scene_of(study, path))), _STEPS))


def _robots() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((scene_folder() / "robots").glob("*.urdf"))}


def _read_robot(path: Path) -> None:
    read_urdf(path)
    read_collisions(path)


def _read_problem(path: Path) -> None:
    read_problem(path)


def _read_results(path: Path) -> None:
    """A run file, or a table: as `iapb inspect` and the report read it."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            inspect(path, 3)
    except RunFileError:
        read_table(path, "sample")


def _only_text_or_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Texts as texts; what is compressed, as bytes."""
    if sample[:2] == b"\x1f\x8b":
        return damaged_bytes(sample, rng)
    return damaged_text(sample.decode(), rng, "" if other[:2] == b"\x1f\x8b" else other.decode())


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
        run = open_store(folder_path := Path(folder)).put(inputs_of(0), sample_run(), "sample")
        columns = (Column("x", np.arange(4.0), "m", "where"), Column("word", tuple("abcd"), "1", "what"))
        write_table(folder_path / "table.h5", Table("sample", columns))
        return {"run.h5": run.read_bytes(), "table.h5": (folder_path / "table.h5").read_bytes()}


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
        for _ in range(int(rng.integers(1, 4))):
            name = names[int(rng.integers(len(names)))]
            if name in file:
                _change(file, name, rng)
    return stream.getvalue()


def _change(file: Any, name: str, rng: Rng) -> None:
    kind, wrong = int(rng.integers(5)), _WRONG[int(rng.integers(len(_WRONG)))]
    owner = file[name] if rng.random() < 0.5 else file
    if kind == 0 and len(owner.attrs):
        attribute = sorted(owner.attrs)[int(rng.integers(len(owner.attrs)))]
        if rng.random() < 0.5:
            del owner.attrs[attribute]
        elif isinstance(wrong, np.ndarray) and wrong.size < 100:
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


_PART, _PARTS = 60, 4  # steps of a chunk of the logs, and how many there are


@cache
def _logged() -> tuple[dict[str, bytes], list[str], str]:
    """The logs of a run, to read and to go on from, and of a live run; what first chunks, and what all, come to."""
    hashes: list[str] = []
    scene = load_scene(find_scene("peg_corner"))
    with tempfile.TemporaryDirectory() as folder:
        simulation = _simulation(scene)
        recorder, total = Recorder(simulation), _PART * _PARTS
        logs = (RunLog(Path(folder) / "run.h5.log", log_head(simulation, "IAPB", total, key=_KEY, code=_KEY)),
                open_log(Path(folder), "live", simulation, "IAPB", total))  # fmt: skip
        for _ in range(_PARTS):
            recorder.chunk(recorder.steps + _PART)
            hashes.append(content_hash(recorder.run("IAPB", "killed")))
            for log, more in zip(logs, ((), (np.zeros((_PART, TICK_COLUMNS)),)), strict=True):
                log.write_chunk(recorder.records[-1], _PART, 0.0, more)
                log.write_state(simulation.arrays())
        for log in logs:
            log.close()
        run, live = (log.path.read_bytes() for log in logs)
        return {"read.h5.log": run, _GO_ON: run, "live.h5.log": live}, hashes, content_hash(recorder.run("IAPB", ""))


_KEY, _GO_ON = "fuzz", "run.h5.log"


def _simulation(scene: Scene) -> Simulation:
    world = find_world("IAPB")
    return Simulation(scene, world.law, world.coupling_in(scene))


def damaged_log(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Damage to the first line, to the lines of blocks, anywhere; or whole blocks lost, doubled or put elsewhere."""
    pieces, kind = _blocks(sample), rng.random()
    if kind < 0.35:
        return damaged_bytes(pieces[0], rng) + b"".join(pieces[1:])
    if kind < 0.6:
        at = int(rng.integers(1, len(pieces)))
        line, _, numbers = pieces[at].partition(b"\n")
        pieces[at] = damaged_bytes(line, rng) + b"\n" + numbers
        return b"".join(pieces)
    if kind < 0.8:
        return damaged_bytes(sample, rng)
    at, to = (int(rng.integers(1, len(pieces))) for _ in range(2))
    taken = (pieces if rng.random() < 0.7 else _blocks(other))[at]
    if rng.random() < 0.5:
        del pieces[to]
    return b"".join([*pieces[:to], taken, *pieces[to:]])


@cache
def _places(log: bytes) -> tuple[int, ...]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log"
        path.write_bytes(log)
        return (0, *(block.start for block in read_log(path)[1]), len(log))


def _blocks(log: bytes) -> list[bytes]:
    """The first line of a log, and each of its blocks."""
    return [log[start:end] for start, end in pairwise(_places(log))]


class WrongContent(Exception):
    """Something else came of a damaged log than of the whole one."""


def _read_log(path: Path) -> None:
    """Go on to the end of a run; of a live run, and of another, make readable what there is."""
    _, parts, whole = _logged()
    target = path.with_suffix("")
    target.unlink(missing_ok=True)
    if path.name == _GO_ON:
        simulation = _simulation(load_scene(find_scene("peg_corner")))
        stream(Place(_KEY, target), simulation, "IAPB", _PART * _PARTS, resume=True)
        if read_entry(target).content_hash != whole:
            raise WrongContent("the run that went on is another one")
    elif read_entry(finish_live(path, "killed")[0] if is_live(path) else recover(path)).content_hash not in parts:
        raise WrongContent("the steps are others than were recorded")


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
_ENDS = (0, 1, 2)


class LineError(Exception):
    """A command line ended in a way that none may: another status, no message, a traceback in the text."""


def lines() -> dict[str, bytes]:
    """The valid lines, as JSON lists of words."""
    return {f"{number:02d}.json": json.dumps(line.split()).encode() for number, line in enumerate(_LINES)}


def damaged_line(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Return a line with words changed, as JSON."""
    words = json.loads(sample)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        at = int(rng.integers(len(words) + 1))
        pool = _WORDS if rng.random() < 0.7 else TOKENS
        known, kind = pool[int(rng.integers(len(pool)))], int(rng.integers(5))
        if kind == 0:
            words.insert(at, known)
        elif kind == 1 and at < len(words):
            words[at] = known
        elif kind == 2:
            words = words[:at] + words[at + 1 :]
        elif kind == 3 and at < len(words):
            words[at] = words[at][: int(rng.integers(1 + len(words[at])))] + known
        else:
            words += json.loads(other)[1:]
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
    words = _without_long_work(json.loads(path.read_bytes()))
    status, said, complained = _called(words, path.parent)
    if status not in _ENDS or "Traceback" in complained:
        raise LineError(f"{words}: ended with {status}: {complained}")
    if status and not (complained.strip() or said.strip()):
        raise LineError(f"{words}: ended with {status} and said nothing")
    if status:
        raise IapbError(complained.strip())


def _without_long_work(words: list[str]) -> list[str]:
    """A line that might start long work gets an option that no command has."""
    words = [word for word in words if word != _DEBUG]
    return [*words, "--no-such-option"] if set(words) & set(_LONG) else words


def _called(words: list[str], folder: Path) -> tuple[int, str, str]:
    for place in (folder, folder / "results"):
        place.mkdir(exist_ok=True)
        for name, content in result_files().items():
            if not (place / name).exists():
                (place / name).write_bytes(content)
    out, error, before = io.StringIO(), io.StringIO(), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            status = main(words)
    finally:
        os.chdir(before)
    return status, out.getvalue(), error.getvalue()


KINDS = {kind.name: kind for kind in (
    Kind("scenes in the plane", _planar, _scene_or_text, _read_scene),
    Kind("scenes in space", _spatial, _scene_or_text, _read_scene),
    Kind("URDF robots", _robots, _text_or_bytes, _read_robot, 1.5),
    Kind("sweep studies", _studies, _scene_or_text, _read_study, 1.5),
    Kind("LCP and MLCP files", problem_texts, _only_text_or_bytes, _read_problem, 1.25),
    Kind("FCLIB files", fclib_files, damaged_hdf5, _read_problem),
    Kind("run files and tables", result_files, _only_bytes, _read_results, 1.25),
    Kind("sealed run files", result_files, damaged_hdf5_sealed, _read_results, 0.6),
    Kind("logs of killed runs", lambda: _logged()[0], damaged_log, _read_log, 0.4),
    Kind("command lines", lines, damaged_line, run_line, 0.5),
)}  # fmt: skip
