"""Files made to exhaust memory, crash a library or mislead; each is refused in one sentence, in little memory."""

from __future__ import annotations

import io
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import zipfile
import zlib
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from iapb import certify_impacts, load_scene
from iapb.errors import ArgumentError, IapbError, RunFileError
from iapb.mechanics.urdf import read_urdf
from reference.datasets import DatasetError, read_problem
from reports.cli import main
from reports.store import RunStore, read_run, write_run
from reports.store.io import SEAL, mark_store, sealed, write_whole
from reports.store.parts import Parts
from tests.robustness.faults import sample_run
from tests.robustness.inputs import fclib_files, result_files

pytestmark = pytest.mark.thorough

ROOT = Path(__file__).parents[2]
MOST = 700 << 20  # bytes that a refusal may take beyond what the process had


def command(*words: Any) -> int:
    return main([str(word) for word in words])


def apart(*words: Any, act: Callable[..., Any] = command) -> tuple[int, str]:
    """Run a command line (or `act`) in a process of its own, which may crash; return its status and what it said."""
    def work(pipe: Any) -> None:
        said = io.StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 3 * MOST,) * 2)
            try:
                status = act(*words)
            except IapbError as error:
                status, _ = 1, said.write(str(error))
            except BaseException as error:
                status, _ = -1, said.write(f"Traceback {error!r}")
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) << 10
        pipe.send((status, said.getvalue() if grown < MOST else f"Traceback: took {grown >> 20} MB"))

    ours, theirs = get_context("fork").Pipe()
    child = get_context("fork").Process(target=work, args=(theirs,))
    child.start()
    theirs.close()
    try:
        answer: tuple[int, str] = ours.recv() if ours.poll(60.0) else (-2, "Traceback: hangs")
    except EOFError:
        answer = -3, "Traceback: crashed"
    if child.is_alive():
        child.join(1.0)
        child.kill()
    return answer


def refused(*words: Any, status: int = 1, act: Callable[..., Any] = command) -> str:
    found, said = apart(*words, act=act)
    assert found == status and "Traceback" not in said, (words, found, said[-2000:])
    return said


def forged(path: Path, change: Callable[[Any], None]) -> Path:
    """Write a run, changed by somebody else's program, under a seal that holds."""
    write_run(path, sample_run(), replace=True)
    with h5py.File(path, "r+") as file:
        change(file)
    path.write_bytes(sealed(path.read_bytes()))
    return path


def packed_twice(file: Any) -> None:
    del file["trajectory/q"]
    made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    made.set_chunk((200 << 17,))
    made.set_deflate(9), made.set_deflate(9)
    space = h5py.h5s.create_simple((200 << 17,), (h5py.h5s.UNLIMITED,))
    dataset = h5py.h5d.create(file["trajectory"].id, b"q", h5py.h5t.NATIVE_DOUBLE, space, made)
    dataset.write_direct_chunk((0,), zlib.compress(zlib.compress(bytes(200 << 20))))


def huge_chunk(file: Any) -> None:
    """Few values stated; a chunk that unpacks to 2 GB."""
    del file["trajectory/q"]
    dataset = file.create_dataset("trajectory/q", (3,), "u1", chunks=(1 << 20,), maxshape=(None,), compression="gzip")
    packer = zlib.compressobj(9)
    content = b"".join(packer.compress(bytes(1 << 24)) for _ in range(128)) + packer.flush()
    dataset.id.write_direct_chunk((0,), content)


def deep(file: Any) -> None:
    group = file.id
    for _ in range(20_000):
        group = h5py.h5g.create(group, b"g")


def a_loop(file: Any) -> None:
    file["law/again"] = file["/"]
    file["scene/again"] = file["/"]


def many_attributes(file: Any) -> None:
    file.attrs["remarks"] = np.array(["a"] * 3000, h5py.string_dtype())


def far_offsets(file: Any) -> None:
    file["contacts/offsets"][1:] = 10**12


def short(file: Any) -> None:
    values = file["steps/impulse"][:3]
    del file["steps/impulse"]
    file["steps/impulse"] = values


def deep_json(file: Any) -> None:
    del file["scene/resolved"]
    file["scene/resolved"] = "[" * 100_000


def no_scene(file: Any) -> None:
    del file["scene/resolved"]
    file["scene/resolved"] = '{"name": "x", "bodies": 7}'


def no_text(file: Any) -> None:
    del file["scene/name"]
    file.create_dataset("scene/name", data=np.bytes_(b"\xff\xfe\x00\x80"), dtype=h5py.string_dtype("utf-8", 4))


def two_lines(file: Any) -> None:
    del file["scene/name"]
    file["scene/name"] = "peg\nNothing wrong was found."


def nan_poses(file: Any) -> None:
    file["trajectory/q"][...] = np.nan


ATTACKS = (packed_twice, huge_chunk, deep, a_loop, far_offsets, short, deep_json, no_scene, no_text, two_lines)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_a_forged_run_is_refused_by_every_reader(attack: Callable[[Any], None], tmp_path: Path) -> None:
    mark_store(tmp_path)
    path = forged(tmp_path / "forged.h5", attack)
    write_run(tmp_path / "whole.h5", sample_run())
    for words in (["certify", path], ["store", "again", path], *([["inspect", path]] * (attack is not no_scene))):
        said = refused(*words)
        assert said.count("\n") <= 4, said
    assert "1 of 2" in refused("store", "again", tmp_path)
    said = refused("certify", tmp_path)
    assert "forged.h5: not certified" in said and "whole.h5: none of" in said
    refused("store", "check", tmp_path, status=int(attack is not no_scene))
    refused("store", "repair", tmp_path, status=0)


def test_many_references_to_one_text_are_read_within_the_budget(tmp_path: Path) -> None:
    path = tmp_path / "texts.h5"
    write_run(path, sample_run())
    with h5py.File(path, "r+") as file:
        texts = file.create_dataset("provenance/many", 60_000, dtype=h5py.string_dtype())
        texts[0] = "x" * 1_000_000
        file.flush()
        start = texts.id.get_offset()
    content = bytearray(path.read_bytes())
    content[start : start + 16 * 60_000] = bytes(content[start : start + 16]) * 60_000
    path.write_bytes(sealed(bytes(content)))
    assert "budget" in refused("inspect", path)


@pytest.mark.parametrize("change", [nan_poses, many_attributes])
def test_what_is_odd_is_read_or_refused(change: Callable[[Any], None], tmp_path: Path) -> None:
    path = forged(tmp_path / "odd.h5", change)
    for words in (["inspect", path], ["certify", path], ["store", "again", path]):
        status, said = apart(*words)
        assert status in (0, 1) and "Traceback" not in said, said


def test_a_budget_can_be_raised_and_lowered(tmp_path: Path) -> None:
    path = write_run(tmp_path / "run.h5", sample_run())
    assert read_run(path, budget=1 << 30).steps == sample_run().steps
    with pytest.raises(Exception, match="budget"):
        read_run(path, budget=100_000)


def test_fclib_and_npz_cannot_ask_for_any_memory(tmp_path: Path) -> None:
    for name, size, kind in (("a.hdf5", 4000, "S1000000"), ("b.hdf5", 10**8, "f8")):
        (tmp_path / name).write_bytes(fclib_files()["local.hdf5"])
        with h5py.File(tmp_path / name, "r+") as file:
            del file["fclib_local/vectors/q"]
            file.create_dataset("fclib_local/vectors/q", (size,), kind)
    with h5py.File(tmp_path / "deep.hdf5", "w") as file:
        deep(file)
    for name in ("a.hdf5", "b.hdf5", "deep.hdf5"):
        assert "cannot be read" in refused(tmp_path / name, act=read_problem), name
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("mass_matrix", "v_minus", "v_plus"):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array_header_1_0(
                    member, {"descr": "<f8", "fortran_order": False, "shape": (100_000_000, 1)})
                for _ in range(100):
                    member.write(bytes(8_000_000))
    assert "unpacks to" in refused("certify", tmp_path / "bomb.npz")
    os.mkfifo(tmp_path / "pipe.npz")
    assert "no regular file" in refused("certify", tmp_path / "pipe.npz")


@pytest.mark.parametrize(("before", "after"), [
    (b"format\0\0\x19\1", b"format\0\0\x19\x78"),  # the type of a text, on which HDF5 ends with SIGSEGV
    (b"word\0\0\0\0\x1a\0\0\0\0\0\0\0\x08\0", b"word\0\0\0\0\x1a\0\0\0\0\0\0\0\x08\4"),  # a size: a search without end
    (b"DIMENSION_SCALE", b"DIMENSION_\xffCALE"),  # a text that is freed twice
])  # fmt: skip
def test_a_file_that_crashes_hdf5_or_has_no_end_stops_no_reader(before: bytes, after: bytes, tmp_path: Path) -> None:
    mark_store(tmp_path)
    for name, content in result_files().items():
        (tmp_path / name).write_bytes(sealed(content[:-SEAL].replace(before, after)))
    for words in ("store check", "store repair", "store again", "certify"):
        assert apart(*words.split(), tmp_path)[0] in (0, 1), words
    for words in ("inspect", "certify", "store again", "verify --recheck"):
        assert apart(*words.split(), tmp_path / "run.h5")[0] in (0, 1), words
    os.unlink(tmp_path / "iapb-store.json")
    assert apart(tmp_path / "run.h5", act=read_run)[0] not in (-2, -3)


def test_pipes_and_encodings_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.lcp")
    with pytest.raises(DatasetError, match="no regular file"):
        read_problem(tmp_path / "pipe.lcp")
    with pytest.raises(ArgumentError, match="no regular file"):
        load_scene(tmp_path / "pipe.lcp")
    for encoding in ("utf-7", "idna", "undefined", "rot13", "utf-32", "punycode", "base64", "no such"):
        (tmp_path / "arm.urdf").write_text(f"<?xml version='1.0' encoding='{encoding}'?><robot name='r'/>")
        with pytest.raises(ArgumentError):
            read_urdf(tmp_path / "arm.urdf")


@pytest.mark.parametrize(("matrix", "said"), [
    ([[1.0 + 1e-3j, 0.0], [0.0, 1.0]], "mass_matrix = .*real numbers"), ([["1", "0"], ["0", "1"]], "real numbers"),
    ([[1.0, 2.0], [2.0, 1.0]], "impact 0.*negative"), ([[1.0, 0.0], [0.0]], "real numbers"),
    (np.ma.masked_array(np.eye(2), mask=True), "real numbers"), (np.eye(2) + np.longdouble(1e-18), "finite double"),
    (np.eye(2) * np.longdouble("1e400"), "finite double"),
])  # fmt: skip
def test_impacts_of_no_mass_matrix_are_refused(matrix: Any, said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        certify_impacts(matrix, [1.0, 0.0], [-1.0, 0.0])


def test_parts_without_their_law_do_not_stop_a_repair(tmp_path: Path) -> None:
    mark_store(tmp_path)
    heads: tuple[dict[str, Any], ...] = ({}, {"scene_resolved": {}, "world": "IAPB"}, {"live": 3})
    for number, head in enumerate(heads):
        Parts(tmp_path / f"{number}.h5.parts", head).close()
    (tmp_path / "3.h5.parts").mkdir()
    line = b'{"format": "iapb part", "format_version": 1, "number": 0, "arrays": ' + b"[" * 100_000
    (tmp_path / "3.h5.parts" / "00000000.part").write_bytes(sealed(line))
    (tmp_path / "4.h5.parts").mkdir()
    (tmp_path / "4.h5.parts" / "00000000.part").write_bytes(sealed(b'{"format": "iapb part"\xff\n'))
    shutil.copytree(tmp_path / "0.h5.parts", tmp_path / "5.h5.parts")
    os.mkfifo(tmp_path / "5.h5.parts" / "00000001.part")
    said = refused("store", "repair", tmp_path, status=0)
    assert said.count("left as they are") == 6 and "law" in said
    refused("store", "gc", tmp_path, "--delete", status=0)


def strewn(folder: Path) -> int:
    """Fill a store with 200 foreign and damaged files of every name that ours have; return their number."""
    run, table = write_run(folder / "ours.h5", sample_run()).read_bytes(), b'{"format": "iapb part"'
    noted = io.BytesIO()
    with h5py.File(noted, "w") as file:  # speaks of us, and is not ours
        file.attrs.update({"format": "a note", "format_version": 4, "tool": "made with: iapb run peg_corner"})
    rng = np.random.default_rng(0)
    flipped = bytearray(run)
    flipped[len(run) // 2] ^= 1
    contents = (b"", b"half", run[: len(run) // 2], bytes(flipped), run[:-91], noted.getvalue(),
                sealed(noted.getvalue()), sealed(b"text"), table,
                sealed(b"x" + table), rng.bytes(999), b"\x89HDF\r\n\x1a\n", run + b"more")
    names = ("{}.h5", "run{}-0123456789abcdef.h5", ".x{}.h5.77.writing", "x{}.h5.partial", "x{}.h5.damaged",
             "run{}-0123456789abcdef.h5.partial", "run{}-0123456789abcdef.h5.damaged", ".iapb-store.json.{}.writing",
             ".0000000{}.part.7.writing", "{}.h5.parts/00000001.part", "{}.h5.parts/lock", "{}.h5.parts/00000000.part",
             "{}.h5.parts/.00000000.part.7.writing", "notes{}.txt", "mine{}.writing")  # fmt: skip
    for number, content in enumerate(contents):
        for name in names:
            path = folder / name.format(number)
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
    (folder / "twin.h5").hardlink_to(folder / "ours.h5")
    (folder / "link.h5").symlink_to(folder / "ours.h5")
    (folder / "new\nline.h5").write_bytes(bytes(flipped))
    os.mkfifo(folder / "pipe.h5")
    os.mkfifo(folder / ".p.h5.1.writing")
    for path in folder.rglob("*"):
        os.utime(path, (0, 0), follow_symlinks=False)
    return len(contents) * len(names)


def listing(folder: Path) -> dict[str, Any]:
    return {str(path): path.read_bytes() if path.is_file() and not path.is_symlink() else path.lstat().st_mode
            for path in sorted(folder.rglob("*"))}


def test_no_foreign_byte_is_changed(tmp_path: Path) -> None:
    mark_store(tmp_path)
    assert strewn(tmp_path) + 6 > 200
    before = listing(tmp_path)
    for words, status in (("store check", 1), ("store repair", 0), ("store gc", 0), ("store gc --delete", 0),
                          ("store again", 1), ("certify", 1)):
        said = refused(*words.split(), tmp_path, status=status)
        assert "\nline.h5" not in said
    RunStore(tmp_path)
    assert listing(tmp_path) == before


def shell(line: str, folder: Path, **more: Any) -> subprocess.CompletedProcess[str]:
    program = line.replace("IAPB", f"{sys.executable} -m reports.cli")
    return subprocess.run(["bash", "-c", program], cwd=folder, capture_output=True, timeout=120, text=True,
                          env={**os.environ, "PYTHONPATH": str(ROOT)}, **more)  # fmt: skip


@pytest.mark.parametrize(("line", "status", "said"), [
    ("IAPB scenes | true; echo ${PIPESTATUS[0]}", "0", ""),
    ("IAPB --help | true; echo ${PIPESTATUS[0]}", "0", ""),
    ("IAPB inspect run.h5 | true; echo ${PIPESTATUS[0]}", "0", ""),
    ("IAPB inspect run.h5 >/dev/full; echo $?", "1", "iapb: standard output: No space left on device\n"),
    ("IAPB --help >/dev/full; echo $?", "1", "iapb: standard output: No space left on device\n"),
    ("IAPB inspect run.h5 2>/dev/full >/dev/null; echo $?", "0", ""),
    ("IAPB inspect absent.h5 2>/dev/full; echo $?", "1", ""),
    ("IAPB inspect run.h5 >&-; echo $?", "0", ""),
    ("IAPB run peg_corner --set duration=0.01 --out out >&- 2>&-; echo $?; cat out/*.h5 | wc -c >&2", "0", "0"),
    ("IAPB inspect run.h5 <&- >&- 2>&-; echo $?", "0", ""),
])  # fmt: skip
def test_streams_that_end_or_are_full_blame_no_file(line: str, status: str, said: str, tmp_path: Path) -> None:
    write_run(tmp_path / "run.h5", sample_run())
    done = shell(line, tmp_path)
    assert done.stdout.strip() == status and "run.h5" not in done.stderr and "Traceback" not in done.stderr, done
    assert done.stderr == said or (said == "0" and int(done.stderr) > 1000), done


def test_names_stay_on_one_line_and_a_folder_without_runs_is_not_certified(tmp_path: Path) -> None:
    assert "expected run files, or folders that hold some" in refused("certify", tmp_path)
    said = refused("run", "peg_corner", "--set", "duration=0.4", "--out", tmp_path / "a\nname", status=0)
    assert "a\\nname" in said and "\nname" not in said.replace("a\\nname", "")


def limited(act: Callable[..., Any], *words: Any) -> Any:
    """Do something where no file may have more than 50 bytes."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))
    return act(*words)


def test_what_cannot_be_written_is_named_and_leaves_nothing_behind(tmp_path: Path) -> None:
    run, place = write_run(tmp_path / "run.h5", sample_run()), tmp_path / "new" / "file"
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RunFileError, match="pipe: cannot be written: .* in its place"):
        write_whole(tmp_path / "pipe", "text")
    assert command("certify", run, "--export", tmp_path / "enough") == 0
    for act, words in ((command, ("certify", run, "--export", place)), (write_whole, (place, "text" * 50)),
                       (mark_store, (place.parent,)), (write_run, (place, sample_run()))):
        said = refused(act, *words, act=limited)
        assert f"{place.parent}/" in said and "cannot be written: File too large" in said, said
        assert list(place.parent.iterdir()) == []


def test_ctrl_c_while_a_file_is_written_ends_the_writer(tmp_path: Path) -> None:
    program = ("import signal, sys, pathlib\nfrom tests.robustness.faults import put, sample_run\nsample_run()\n"
               "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a process in the background ignores it
               "print('go', flush=True)\nfor number in range(10**6): put(pathlib.Path(sys.argv[1]), number)")
    for attempt in range(4):
        child = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], cwd=ROOT, stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)  # fmt: skip
        assert child.stdout is not None and child.stdout.readline() == "go\n"
        time.sleep(0.3 + 0.05 * attempt)
        child.send_signal(signal.SIGINT)
        try:
            _, said = child.communicate(timeout=20)
        finally:
            child.kill()
        assert child.returncode == -signal.SIGINT and "ignored" not in said, said


def test_colours_and_directions_of_a_file_do_not_pass(tmp_path: Path) -> None:
    """On a terminal, too."""
    orders = "\x1b[8mhidden\x1b[0m \u200f\u061c\u200bx"
    write_run(tmp_path / "run.h5", sample_run(), provenance={"commit": orders})
    program = f"import pty, sys; sys.exit(pty.spawn([{sys.executable!r}, '-m', 'reports.cli', 'inspect', 'run.h5']))"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, timeout=60, text=True,
                          env={**os.environ, "PYTHONPATH": str(ROOT)}, stdin=subprocess.DEVNULL)  # fmt: skip
    assert "hidden" in done.stdout and not set(done.stdout) & set("\x1b\u200f\u061c\u200b"), json.dumps(done.stdout)
