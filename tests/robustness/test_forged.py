"""Files of others, made to exhaust memory, crash a library, mislead, show other files or order a
terminal about.

Each is refused in one sentence, in little memory and time.
"""

import gzip
import io
import json
import os
import re
import resource
import subprocess
import sys
import zlib
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing import get_context
from pathlib import Path

import h5py
import numpy as np
import pytest

from iapb.errors import ArgumentError, IapbError, RunFileError
from iapb.mechanics.urdf import read_urdf
from reference.datasets import read_problem
from reports.cli import Harmless, harmless, main
from reports.store import read_run, write_run
from reports.store.io import sealed
from tests.robustness.samples import fclib_files, sample_run

pytestmark = pytest.mark.thorough

ROOT = Path(__file__).parents[2]
MOST = 700 << 20  # bytes that a refusal may take beyond what the process had
SECRET = b"root:x:0:0:a line of a password file that nobody may see\n" * 4
ORDERS = "\x1b]0;owned\x07\x1b[2J\x9b31m\rfake\x08\u202eevil"


def command(*words):
    return main([str(word) for word in words])


def apart(*words, act=command):
    """Run a command line (or `act`) in a process of its own, which may crash; return its status and
    what it said."""

    def work(pipe):
        said = io.StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 3 * MOST,) * 2)
            try:
                status = act(*words)
            except IapbError as error:
                status = 1
                _ = said.write(str(error))
            except BaseException as error:
                status = -1
                _ = said.write(f"Traceback {error!r}")
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) << 10
        pipe.send(
            (status, said.getvalue() if grown < MOST else f"Traceback: took {grown >> 20} MB")
        )

    ours, theirs = get_context("fork").Pipe()
    child = get_context("fork").Process(target=work, args=(theirs,))
    child.start()
    theirs.close()
    try:
        answer = ours.recv() if ours.poll(60.0) else (-2, "Traceback: hangs")
    except EOFError:
        answer = -3, "Traceback: crashed"
    if child.is_alive():
        child.join(1.0)
        child.kill()
    return answer


def refused(*words, status=1, act=command):
    found, said = apart(*words, act=act)
    assert found == status and "Traceback" not in said, (words, found, said[-2000:])
    return said


def forged(path, change):
    """Write a run, changed by somebody else's program, under a seal that holds."""
    write_run(path, sample_run(), replace=True)
    with h5py.File(path, "r+") as file:
        change(file)
    path.write_bytes(sealed(path.read_bytes()))
    return path


def private(file):
    """Another file of the reader's, which a run file may not show: as text and as HDF5."""
    path = Path(file.filename).parents[1] / "private.h5"
    path.with_suffix(".txt").write_bytes(SECRET)
    with h5py.File(path, "w") as other:
        other["secret"] = SECRET.decode()
        other["numbers"] = np.arange(3.0)
    return str(path)


def external_storage(file):
    del file["trajectory/q"]
    flat = private(file).replace(".h5", ".txt")
    file.create_dataset("trajectory/q", (len(SECRET),), "u1", external=[(flat, 0, len(SECRET))])


def virtual(file):
    del file["trajectory/q"]
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource(private(file), "numbers", shape=(3,))
    file.create_virtual_dataset("trajectory/q", layout)


def packed_twice(file):
    del file["trajectory/q"]
    made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    made.set_chunk((200 << 17,))
    made.set_deflate(9), made.set_deflate(9)
    space = h5py.h5s.create_simple((200 << 17,), (h5py.h5s.UNLIMITED,))
    dataset = h5py.h5d.create(file["trajectory"].id, b"q", h5py.h5t.NATIVE_DOUBLE, space, made)
    dataset.write_direct_chunk((0,), zlib.compress(zlib.compress(bytes(200 << 20))))


def huge_chunk(file):
    """Few values stated; a chunk that unpacks to 2 GB."""
    del file["trajectory/q"]
    dataset = file.create_dataset(
        "trajectory/q", (3,), "u1", chunks=(1 << 20,), maxshape=(None,), compression="gzip"
    )
    packer = zlib.compressobj(9)
    content = b"".join(packer.compress(bytes(1 << 24)) for _ in range(128)) + packer.flush()
    dataset.id.write_direct_chunk((0,), content)


def far_offsets(file):
    file["contacts/offsets"][1:] = 10**12


def replaced(name, value):
    """Return an attack that puts something else in the place of a part of a run."""

    def attack(file):
        new = value(file) if callable(value) else value
        del file[name]
        file[name] = new

    return attack


ATTACKS = {  # by name: the attack, and what the refusal says
    "external link": (
        replaced("scene/name", lambda file: h5py.ExternalLink(private(file), "/secret")),
        "another file",
    ),
    "soft link": (replaced("scene/name", h5py.SoftLink("/law/name")), "soft link"),
    "external storage": (external_storage, "stored in another file"),
    "virtual": (virtual, "put together"),
    "packed twice": (packed_twice, ""),
    "huge chunk": (huge_chunk, ""),
    "far offsets": (far_offsets, ""),
    "no scene": (replaced("scene/resolved", '{"name": "x", "bodies": 7}'), ""),
}


@pytest.mark.parametrize("name", ATTACKS)
def test_a_forged_run_is_refused_by_every_reader_and_shows_no_other_file(name, tmp_path):
    store = tmp_path / "store"
    attack, told = ATTACKS[name]
    store.mkdir()
    path = forged(store / "forged.h5", attack)
    write_run(store / "whole.h5", sample_run())
    for words in (["certify"], ["store", "again"], *([["inspect"]] * (name != "no scene"))):
        said = refused(*words, path)
        assert said.count("\n") <= 4 and told in said and "password" not in said, said
    assert "1 of 2" in refused("store", "again", store)
    said = refused("certify", store)
    assert "forged.h5: not certified" in said and "whole.h5: none of" in said
    refused("store", "check", store, status=int(name != "no scene"))


def test_many_references_to_one_text_are_read_within_the_budget_which_can_be_lowered(tmp_path):
    path = write_run(tmp_path / "texts.h5", sample_run())
    with pytest.raises(RunFileError, match="budget"):
        read_run(path, budget=100_000)
    with h5py.File(path, "r+") as file:
        texts = file.create_dataset("provenance/many", 60_000, dtype=h5py.string_dtype())
        texts[0] = "x" * 1_000_000
        file.flush()
        start = texts.id.get_offset()
    content = bytearray(path.read_bytes())
    content[start : start + 16 * 60_000] = bytes(content[start : start + 16]) * 60_000
    path.write_bytes(sealed(bytes(content)))
    assert "budget" in refused("inspect", path)


def test_problem_files_npz_and_robots_cannot_ask_for_any_memory_nor_show_another_file(tmp_path):
    for name, given, told in (
        ("q", {"shape": 10**8, "dtype": "f8"}, "cannot be read"),
        ("mu", None, "vectors/mu is a link to another file"),
    ):
        path = tmp_path / f"{name}.hdf5"
        path.write_bytes(fclib_files()["local.hdf5"])
        with h5py.File(path, "r+") as file:
            group = file["fclib_local/vectors"]
            del group[name]
            if given:
                group.create_dataset(name, **given)
            else:
                group[name] = h5py.ExternalLink(str(path), "/info/title")
        assert told in refused(path, act=read_problem), name
    np.savez_compressed(tmp_path / "bomb.npz", v_minus=np.zeros((100_000_000, 1)))
    assert "unpacks to" in refused("certify", tmp_path / "bomb.npz")
    (tmp_path / "bomb.lcp.gz").write_bytes(gzip.compress(b"0 " * (40 << 20), 1))
    assert "MB" in refused(tmp_path / "bomb.lcp.gz", act=read_problem)
    robots = [{"name": f"r{k}", "urdf": "absent.urdf"} for k in range(1000)]
    scene = {"name": "s", "dimensions": 3, "rate": 100, "duration": 1, "bodies": []}
    (tmp_path / "s.yaml").write_text(json.dumps(scene | {"robots": robots}))
    assert "at most 100 items" in refused("run", tmp_path / "s.yaml")


def test_a_pipe_is_refused_and_not_waited_for_and_odd_encodings_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("pipe.h5", "pipe.npz", "pipe.lcp", "pipe.yaml", "arm.urdf"):
        os.mkfifo(name)
    Path("scene.yaml").write_text(
        "{name: s, dimensions: 3, rate: 100, duration: 1, bodies: [], robots: [{name: a, urdf: arm.urdf}]}"
    )
    for line in ("inspect pipe.h5", "store check pipe.h5", "run scene.yaml", "run pipe.yaml"):
        refused(*line.split())
    assert "no regular file" in refused("certify", "pipe.npz")
    assert "no regular file" in refused("pipe.lcp", act=read_problem)
    for encoding in ("utf-7", "undefined", "rot13", "utf-32", "no such"):
        text = f"<?xml version='1.0' encoding='{encoding}'?><robot name='r'/>"
        Path("other.urdf").write_text(text)
        with pytest.raises(ArgumentError):
            read_urdf("other.urdf")


def process(*words, folder):
    return subprocess.run(
        words,
        cwd=folder,
        capture_output=True,
        timeout=120,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.DEVNULL,
    )


FULL = "iapb: standard output: No space left on device\n"


@pytest.mark.parametrize(
    ("line", "status", "said"),
    [
        ("IAPB scenes | true; echo ${PIPESTATUS[0]}", "0", ""),
        ("IAPB inspect run.h5 >/dev/full; echo $?", "1", FULL),
        ("IAPB inspect run.h5 2>/dev/full >/dev/null; echo $?", "0", ""),
        ("IAPB inspect run.h5 >&-; echo $?", "0", ""),
        (
            "IAPB run peg_corner --set duration=0.01 --out out >&- 2>&-; echo $?; cat out/*.h5 | wc -c >&2",
            "0",
            "0",
        ),
    ],
)
def test_streams_that_end_or_are_full_blame_no_file(line, status, said, tmp_path):
    write_run(tmp_path / "run.h5", sample_run())
    done = process(
        "bash", "-c", line.replace("IAPB", f"{sys.executable} -m reports.cli"), folder=tmp_path
    )
    assert (
        done.stdout.strip() == status
        and "run.h5" not in done.stderr
        and "Traceback" not in done.stderr
    ), done
    assert done.stderr == said or (said == "0" and int(done.stderr) > 1000), done


def test_no_text_or_name_of_a_file_gives_the_terminal_orders(tmp_path, capsys):
    orders = f"\x1b[8mhidden\x1b[0m \u200f\u061c\u200bx{ORDERS}"
    facts = {"commit": orders, ORDERS: "a name"}
    path = write_run(tmp_path / f"{ORDERS}.h5", sample_run(), provenance=facts)
    command = [sys.executable, "-m", "reports.cli", "inspect", path.name]
    terminal = f"import pty, sys; sys.exit(pty.spawn({command!r}))"
    assert main(["inspect", str(path)]) == 0
    shown = (*capsys.readouterr(), process(sys.executable, "-c", terminal, folder=tmp_path).stdout)
    path.write_bytes(b"no run")
    assert main(["inspect", str(path)]) == 1 and main(["store", "check", str(path)]) == 1
    for text in (*shown, *capsys.readouterr()):
        assert not set(text) & set("\x1b\x07\x9b\x08\u202e\u200f\u061c\u200b"), json.dumps(text)
    assert "\\x1b]0;owned\\x07" in shown[0] and "hidden" in shown[0] and "hidden" in shown[2]


def test_a_terminal_gets_colours_and_nothing_else_that_it_obeys():
    stream = io.StringIO()
    stream.isatty = lambda: True
    Harmless(stream, re.compile(r"(\x1b\[[0-9;]*m)")).write(f"\x1b[1;31mred\x1b[0m\n{ORDERS}")
    assert stream.getvalue() == f"\x1b[1;31mred\x1b[0m\n{harmless(ORDERS)}"
    assert harmless("tab\tand\nend") == "tab\tand\nend" and "\r" not in harmless(ORDERS)
