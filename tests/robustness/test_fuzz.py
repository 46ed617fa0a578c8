"""Wrong input of every kind: read, or refused by one of iapb's errors; never a traceback, a hang or
endless memory.

Valid samples are damaged by a generator that each case seeds: bytes, texts, plain values, and HDF5.
"""

import contextlib
import copy
import gzip
import io
import json
import resource
import shutil
import signal
import traceback
from collections import Counter
from functools import cache
from itertools import islice
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from iapb import decide_effects, load_scene, simulate
from iapb.errors import IapbError, RunFileError
from iapb.mechanics.urdf import read_urdf
from iapb.scene import scene_folder
from iapb.scene.document import Document
from reference.datasets import read_problem
from reports.commands.inspect import inspect
from reports.store.io import sealed
from reports.store.records import read_record
from reports.sweep import load_study
from tests.given import data_of
from tests.robustness.samples import TIMES, fclib_files, result_files

pytestmark = pytest.mark.thorough

READ = "read"
REFUSED = "refused"
BROKEN = "broken"
# [s] of this process's own time; a case takes milliseconds, the largest legal file a few seconds
LONGEST = 20.0
MEMORY = 4 << 30  # bytes beyond what the process has: a wrong file may not ask for more
STEPS = 3  # of a scene that is read all the same: it must also start
GIVEN = data_of(__file__, "tokens.yaml")
TOKENS = [*sum(GIVEN["tokens"], []), "9" * 400, "e" * 3000]
VALUES = [*sum(GIVEN["values"], []), ["a"] * 50]
MOST_CHANGES = 4  # per case: more, and the first mistake hides the others
NEST = 40  # levels; a scene has seven


def changes(rng):
    """Return a range of a random number of changes."""
    return range(int(rng.integers(1, 1 + MOST_CHANGES)))


def chosen(rng, values):
    """Return one of the values."""
    return values[int(rng.integers(len(values)))]


def damaged_bytes(content, rng):
    """Return the bytes with some lost, repeated, replaced or cut off."""
    for _ in changes(rng):
        at = int(rng.integers(len(content) + 1))
        end = chosen(rng, [at + 1, at + int(2 ** rng.uniform(0, 8)), len(content)])
        piece = content[at:end]
        size = len(piece)
        new = chosen(rng, [b"", piece + piece, rng.bytes(size), bytes(size), b"\xff" * size])
        content = content[:at] + new + content[end:]
    return content


def damaged_text(sample, rng):
    """Return a text with words, lines or characters changed; one in ten, and what is compressed, as
    bytes."""
    packed = b"\x1f\x8b"  # the first bytes of what is compressed
    if sample.startswith(packed) or rng.random() < 0.1:
        return damaged_bytes(sample, rng)
    lines = sample.decode().split("\n")
    for _ in changes(rng):
        k = int(rng.integers(len(lines)))
        line = lines[k]
        at = int(rng.integers(len(line) + 1))
        words = line.split(" ")
        words[int(rng.integers(len(words)))] = str(chosen(rng, TOKENS))
        lines[k : k + 1] = chosen(
            rng,
            [
                [" ".join(words)],
                [line[:at] + chr(int(rng.integers(1, 0xD7FF))) + line[at:]],
                [line[:at]],
                [" " + line],
                [line.lstrip()],
                [],
                [line, chosen(rng, lines)],
            ],
        )
        lines = lines or [""]
    return "\n".join(lines).encode()


def damaged_values(sample, rng):
    """Return a YAML text, half of the time as JSON, which always gets past the first look: its
    values (mappings, lists, numbers, texts) with some replaced, lost, renamed, repeated or
    nested."""
    if rng.random() < 0.5:
        return damaged_text(sample, rng)
    plain = copy.deepcopy(values_of(sample))
    for _ in changes(rng):
        places = list(places_of(plain))
        if not places:
            break
        owner, key = chosen(rng, places)
        other, where = chosen(rng, places)
        value = owner[key]
        taken = copy.deepcopy(other[where])
        kind = int(rng.integers(7))
        if kind == 0:
            del owner[key]
        elif kind == 1 and isinstance(owner, list):
            owner.insert(key, taken)
        elif kind == 1:
            owner[f"{key}s"] = owner.pop(key)
        else:
            nested = value
            for _ in range(int(rng.choice([1, 1, 2, NEST]))):
                nested = [nested] if rng.random() < 0.5 else {"name": nested}
            factor = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.integers(-12, 12))
            scaled = float(value) * factor if isinstance(value, int | float) else nested
            owner[key] = chosen(
                rng,
                [taken, nested, scaled, *(copy.deepcopy(chosen(rng, VALUES)) for _ in range(2))],
            )
    return json.dumps(plain).encode()


@cache
def values_of(sample):
    return Document(sample.decode()).value


def places_of(value):
    """Yield every (mapping or list, key) of plain values."""
    if isinstance(value, dict | list):
        for key in list(value) if isinstance(value, dict) else range(len(value)):
            yield value, key
            yield from places_of(value[key])


def damaged_hdf5(content, rng):
    """Damage to what the file says: parts lost, renamed, of another shape or type."""
    stream = io.BytesIO(content)
    names = []
    with h5py.File(stream, "r+") as file:
        file.visit(names.append)
        for _ in changes(rng):
            name = chosen(rng, names)
            wrong = chosen(rng, WRONG)
            kind = int(rng.integers(5))
            if name not in file:
                continue
            owner = chosen(rng, [file, file[name]])
            if kind == 0 and len(owner.attrs):
                attribute = chosen(rng, sorted(owner.attrs))
                del owner.attrs[attribute]
                if isinstance(wrong, np.ndarray) and rng.random() < 0.5:
                    owner.attrs[attribute] = wrong
            elif kind == 1:
                file.move(name, f"{name}_")
            else:
                del file[name]
                if kind == 2:
                    file.create_group(name)
                elif isinstance(
                    wrong, tuple
                ):  # stated to be large, never written: a few bytes on the disk
                    file.create_dataset(
                        name, shape=wrong, dtype=np.float64, chunks=(1024,) * len(wrong)
                    )
                elif kind == 3:
                    file[name] = wrong
    return stream.getvalue()


WRONG = (
    np.zeros(0),
    np.zeros(3),
    np.array([-1], np.int32),
    np.array([2**31 - 1], np.int64),
    np.array([1e308, np.nan]),
    np.array([[1.0, 2.0], [3.0, 4.0]]),
    np.bytes_("word"),
    "text \u00e9",
    np.array([0, 7, -3], np.int32),
    (2**40,),
    (2**20, 2**20),
    np.array([3], np.int32),
    np.array([-2], np.int32),
    np.array([1 + 2j]),
    np.float64(0.5),
    np.array([True]),
)


# The kinds of input: samples, their damage, and who reads them


@cache
def shipped(pattern):
    """Return the files of the scenes' folder, read once."""
    return {path.name: path.read_bytes() for path in sorted(scene_folder().glob(pattern))}


def read_scene(path):
    """What every command does with a scene: read it, decide its effects, start it."""
    scene = load_scene(path)
    decide_effects(scene)
    simulate(scene, steps=min(STEPS, scene.steps))


def read_study(path):
    """Read it and its scene, and spell out its first points."""
    study, _ = load_study(path)
    list(islice(study.points(), STEPS))


def read_robot(path):
    read_urdf(path)


def read_results(path):
    """A run file, or a table: as `iapb inspect` and the report read it."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            inspect(path, 3)
    except RunFileError:
        read_record(path)


LCP = b"2\n2 1\n1 2\n-5 -6\n"
PROBLEMS = {
    "two.lcp": LCP,
    "two.lcp.gz": gzip.compress(LCP, mtime=0),
    "fathi.dat": b"3\n0\n3\n3\n3\n3\n1 0 0\n2 1 0\n2 2 1\n-8 -6 -4\nexample of Fathi\n",
}


KINDS = {  # samples, damage, reader, and how many cases are tried: fewer where a case takes long
    "scenes": (lambda: shipped("*.yaml"), damaged_values, read_scene, 300),
    "URDF robots": (lambda: shipped("robots/*.urdf"), damaged_text, read_robot, 200),
    "sweep studies": (lambda: shipped("sweeps/*.yaml"), damaged_values, read_study, 200),
    "LCP files": (lambda: PROBLEMS, damaged_text, read_problem, 200),
    "FCLIB files": (fclib_files, damaged_hdf5, read_problem, 60),
    "run files and tables": (result_files, damaged_bytes, read_results, 200),
    "sealed run files": (
        result_files,
        lambda *given: sealed(damaged_hdf5(*given)),
        read_results,
        60,
    ),
}


class TooLong(BaseException):
    """A case took longer than LONGEST. Not an Exception: no reader may catch it."""


def judge(read, path, content):
    """Write a case and let it be read; return the outcome and what was said.

    LONGEST is counted in this process's own time: a busy machine is no hang.
    """

    def stop(*_):
        raise TooLong

    path.write_bytes(content)
    before = signal.signal(signal.SIGVTALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
        try:
            read(path)
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            signal.signal(signal.SIGVTALRM, before)
    except IapbError as error:
        return REFUSED, str(error)
    except KeyboardInterrupt:
        raise
    except BaseException:  # whatever comes is the finding
        return BROKEN, traceback.format_exc()
    return READ, ""


@pytest.fixture
def bounded_memory():
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + MEMORY
    resource.setrlimit(
        resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
    )
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@pytest.mark.usefixtures("bounded_memory")
@pytest.mark.parametrize("kind", KINDS)
def test_wrong_input_is_read_or_refused_and_valid_input_is_read(kind, tmp_path):
    given_samples, damage, read, cases = KINDS[kind]
    shutil.copytree(scene_folder() / "robots", tmp_path / "robots")  # cases may refer to them
    samples = given_samples()
    outcomes = Counter()
    for name, content in samples.items():
        outcome, words = judge(read, tmp_path / name, content)
        assert outcome == READ, words

    @settings(max_examples=cases * TIMES, phases=[Phase.generate], database=None)
    @given(st.integers(0, 2**64 - 1), st.sampled_from(sorted(samples)))
    def damaged(seed, name):
        content = damage(samples[name], np.random.default_rng(seed))
        outcome, words = judge(read, tmp_path / name, content)
        assert outcome != BROKEN, words
        outcomes[outcome] += 1

    damaged()
    assert outcomes[REFUSED] >= outcomes.total() // 4, "damage too mild to try anything"
