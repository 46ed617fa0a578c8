"""`make portable`: check that verdicts do not depend on the processor, by runs under different
machine settings.

A setting chooses other machine code for BLAS (OPENBLAS_CORETYPE), numpy (NPY_DISABLE_CPU_FEATURES),
the engine (IAPB_BUILD_FOR), the C library's sin and exp (GLIBC_TUNABLES) or the number of
threads. Every setting is compared with `default`, the settings that the machine chooses itself:

- runs of engine worlds, and impacts: equal bit for bit, for the kernels call no BLAS
- runs of the other worlds (they solve by LAPACK): q within Q_TOLERANCE
- numerical tests (TESTS): none fails
- `iapb reproduce`: exits with 0, and every outcome that does not depend on measured times is the
  same

Results for the current state of the sources are kept in out/portable and not computed again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from reports.provenance import uncommitted_changes
from reports.show import table_text
from reports.store.keys import hash_of, results_of
from verification.table import titled

ROOT = Path.cwd()
# The numerical tests: all tests except those of documents, browser, tools and worker processes.
TESTS = (
    "tests/iapb",
    "tests/ordinary",
    "tests/reference",
    "tests/verification",
    "tests/reports",
    "--ignore=tests/reports/test_browser.py",
    "--ignore=tests/reports/test_view.py",
    "--ignore=tests/reports/test_sweep.py",
)
# A rigid world solves a problem by LAPACK in each step. Its rounding (1e-16 of a position) grows
# over some 2,000 steps as contacts separate: to 1.3e-9 m at most (peg_hole_space in CBuc), and
# 4e-12 m in the plane. The smallest length in a verdict is a penetration of 1e-4 m, ten thousand
# times as large as the tolerance.
Q_TOLERANCE = 1e-8
# columns with verdicts: of findings and cases, of single trials, of other engines
JUDGED = ("outcome", "holds", "law")
IMPACTS = 200
Q = "trajectory/q"
BLAS = {
    name: {"OPENBLAS_CORETYPE": name}
    for name in ("Haswell", "SkylakeX", "Sandybridge", "Zen", "Prescott")
}
SETTINGS: dict[str, dict[str, str]] = {
    "default": {},
    **BLAS,
    "numpy-baseline": {
        "NPY_DISABLE_CPU_FEATURES": "?"
    },  # numpy gives the names; it silently ignores wrong ones
    "x86-64-v3": {"IAPB_BUILD_FOR": "x86-64-v3"},
    "x86-64-v4": {"IAPB_BUILD_FOR": "x86-64-v4"},
    "libm-baseline": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"},
    "one-thread": {"OPENBLAS_NUM_THREADS": "1"},
    "two-threads": {"OPENBLAS_NUM_THREADS": "2"},
}
BLAS_NAMES = {
    "Zen": {"Zen", "Haswell"},
    "Prescott": {"Prescott", "Katmai"},
}  # that OpenBLAS reports for a name


def main() -> int:
    """Run all settings, print and write the table; return 1 if a setting gives different
    results."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.portable", description=__doc__.partition("\n\n")[0]
    )
    parser.add_argument(
        "--settings",
        nargs="+",
        choices=SETTINGS,
        default=list(SETTINGS),
        metavar="NAME",
        help=f"default: all of {', '.join(SETTINGS)}",
    )
    parser.add_argument(
        "--parts",
        nargs="+",
        choices=PARTS,
        default=list(PARTS),
        help="default: tests runs report; a setting takes minutes, a minute, and ten minutes",
    )
    parser.add_argument("--out", type=Path, default=Path("out/portable"))
    parser.add_argument("--workers", default="2", help="processes of pytest")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        CHILDREN[given.child[0]](Path(given.child[1]))
        return 0
    names = (
        given.settings
        if given.parts == ["tests"]
        else list(dict.fromkeys(["default", *given.settings]))
    )
    folder = given.out.resolve() / state_of_sources()
    rows = [row for name in names if (row := try_setting(name, folder, given.parts, given.workers))]
    print(table(rows))
    return int(any(row["wrong"] for row in rows) or all("not tried" in row for row in rows))


def state_of_sources() -> str:
    """Return the commit, the version of Python, and a hash of uncommitted changes."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True
    )
    return f"{commit.stdout.strip()}-py3.{sys.version_info[1]}-{hash_of(uncommitted_changes())[:8]}"


def try_setting(name: str, folder: Path, parts: list[str], workers: str) -> dict[str, Any]:
    """Return one row of the table: the results under the setting, and the list of differences."""
    here = folder / name
    here.mkdir(parents=True, exist_ok=True)
    machine = _facts({}, here / "machine.json")
    row: dict[str, Any] = {"setting": name, "wrong": []}
    setting, reason = environment(name, machine, here)
    if reason:
        return row | {"not tried": reason}
    row["facts"] = facts = _facts(setting, here / "facts.json")
    if without := not_in_force(name, facts, machine):
        row["wrong"].append(f"not in force: {without}")
        return row
    print(
        f"{name}: {' '.join(f'{key}={value}' for key, value in setting.items()) or 'nothing set'}; "
        f"BLAS {'/'.join(facts['blas'])}, {facts['threads']} threads, engine for {facts['engine']}",
        file=sys.stderr,
        flush=True,
    )
    for part in parts:
        row[part] = PARTS[part](name, setting, folder, workers)
        row["wrong"] += row[part].pop("wrong")
    return row


def environment(name: str, machine: dict[str, Any], here: Path) -> tuple[dict[str, str], str]:
    """Return the environment variables of a setting on this machine, and why it cannot be tried (or
    empty)."""
    setting = dict(SETTINGS[name])
    lacking = {
        "SkylakeX": "AVX512_SKX",
        "Haswell": "AVX2",
        "Zen": "AVX2",
        "Sandybridge": "AVX",
        "libm-baseline": "FMA3",
        "x86-64-v3": "AVX2",
        "x86-64-v4": "AVX512_SKX",
    }.get(name)
    if lacking and lacking not in machine["features"]:
        return setting, f"the processor lacks {lacking}"
    if name == "numpy-baseline":
        if not machine["optional"]:
            return setting, "the processor has none of the features that numpy has code for"
        setting["NPY_DISABLE_CPU_FEATURES"] = " ".join(machine["optional"])
    return setting, ""


def not_in_force(name: str, facts: dict[str, Any], machine: dict[str, Any]) -> str:
    """Return which change of the setting had no effect in the process; empty if all took effect."""
    if name in BLAS and not set(facts["blas"]) <= BLAS_NAMES.get(name, {name}):
        return f"OpenBLAS took {facts['blas']}"
    if name == "numpy-baseline" and facts["optional"]:
        return f"numpy still uses {facts['optional']}"
    if name.startswith("x86") and name != facts["engine"]:
        return f"the engine is made for {facts['engine']}"
    if name == "libm-baseline" and facts["libm"] == machine["libm"]:
        return "the C library gives the same sines"
    wanted = {"one-thread": 1, "two-threads": min(2, os.cpu_count() or 1)}.get(
        name, facts["threads"]
    )
    return "" if facts["threads"] == wanted else f"OpenBLAS has {facts['threads']} threads"


def _facts(setting: dict[str, str], path: Path) -> dict[str, Any]:
    path.unlink(missing_ok=True)
    if _run(
        [sys.executable, __file__, "--child", "facts", str(path)], setting, path.with_suffix(".log")
    ):
        raise SystemExit(
            f"A process cannot start under {setting or 'no setting'}: see {path.with_suffix('.log')}"
        )
    return json.loads(path.read_text(encoding="utf-8"))


def _run(command: list[str], setting: dict[str, str], log: Path) -> int:
    """Run a command under one setting only, with its output in a file."""
    clean = {
        key: value
        for key, value in os.environ.items()
        if all(key not in one for one in SETTINGS.values())
    }
    with log.open("w", encoding="utf-8") as file:
        return subprocess.run(
            command,
            cwd=ROOT,
            stdout=file,
            stderr=subprocess.STDOUT,
            env=clean | {"PYTHONPATH": str(ROOT)} | setting,
        ).returncode


def run_tests(name: str, setting: dict[str, str], folder: Path, workers: str) -> dict[str, Any]:
    """Run the numerical tests; return how many passed and which failed."""
    path = folder / name / "tests.xml"
    log = folder / name / "tests.log"
    if not path.is_file():
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-m",
            "",
            "-n",
            workers,
            f"--junitxml={path}.partial",
            *TESTS,
        ]
        if _run(command, setting, log) not in (0, 1):  # 2 and more: not run to the end
            return {"passed": 0, "failed": 0, "wrong": [f"not run to the end: see {log}"]}
        Path(f"{path}.partial").replace(path)
    cases = list(ElementTree.parse(path).iter("testcase"))
    bad = [
        f"{case.get('classname')}::{case.get('name')}: {fault.get('message')}"
        for case in cases
        for fault in case
        if fault.tag in ("failure", "error")
    ]
    passed = len(cases) - len(bad) - sum(case.find("skipped") is not None for case in cases)
    wrong = [f"test: {case}" for case in bad] if cases else ["no test ran"]
    return {"passed": passed, "failed": len(bad), "wrong": wrong}


def run_runs(name: str, setting: dict[str, str], folder: Path, workers: str) -> dict[str, Any]:
    """Run every shipped scene in every world, and impacts; compare them with those of the
    default."""
    path = folder / name / "runs.json"
    command = [sys.executable, __file__, "--child", "runs", str(path)]
    log = path.with_suffix(".log")
    if not path.is_file() and _run(command, setting, log):
        return {"wrong": [f"runs were not computed: see {log}"]}
    theirs, ours = (
        json.loads((folder / one / "runs.json").read_text(encoding="utf-8"))
        for one in ("default", name)
    )
    found: dict[str, Any] = {
        "engine": 0,
        "engine equal": 0,
        "other": 0,
        "other equal": 0,
        "largest": 0.0,
        "largest q": 0.0,
        "wrong": [],
    }
    for label in theirs:
        kind = theirs[label]["kind"]
        equal = theirs[label]["hashes"] == ours[label]["hashes"]
        found[kind] += 1
        found[f"{kind} equal"] += equal
        if equal:
            continue
        differ = [
            key
            for key, value in theirs[label]["hashes"].items()
            if ours[label]["hashes"].get(key) != value
        ]
        q, largest = _differences(
            folder / "default" / f"{label}.npz", folder / name / f"{label}.npz"
        )
        found["largest"], found["largest q"] = (
            max(found["largest"], largest),
            max(found["largest q"], q),
        )
        if kind == "engine" or not q <= Q_TOLERANCE:
            found["wrong"].append(f"{label}: {', '.join(differ[:4])} differ; q by {q:.1e}")
    return found


def _differences(first: Path, second: Path) -> tuple[float, float]:
    """Return the largest difference of q and of any array; infinite if the two files have different
    entries."""
    gaps = {Q: 0.0}
    with np.load(first) as old, np.load(second) as new:
        if old.files != new.files:
            return np.inf, np.inf
        for key in old.files:
            if old[key].shape != new[key].shape:
                gaps[key] = np.inf
            elif old[key].dtype.kind in "fiu":
                a = old[key].astype(float)
                b = new[key].astype(float)
                gaps[key] = float(
                    np.max(
                        np.nan_to_num(
                            np.abs(a - b)[~((a == b) | (np.isnan(a) & np.isnan(b)))], nan=np.inf
                        ),
                        initial=0.0,
                    )
                )
            elif old[key].dtype.kind == "U" and old[key] != new[key]:
                return np.inf, np.inf  # one of them was refused, or says something else
    return gaps[Q], max(gaps.values())


def run_report(name: str, setting: dict[str, str], folder: Path, workers: str) -> dict[str, Any]:
    """Run `iapb reproduce`; return its exit status and a comparison with the outcomes of the
    default."""
    from iapb import IapbError
    from reports.pages.difference import EXACT, TIMING, compare_reports
    from reports.pages.numbers_file import read_numbers

    here = folder / name / "report"
    if not (here / "status").is_file():
        command = [
            sys.executable,
            "-c",
            "from reports.cli import main; main()",
            "reproduce",
            "--out",
            str(here),
        ]
        status = _run(command, setting, folder / name / "report.log")
        for part in ("runs", "tables"):  # half a gigabyte each time
            shutil.rmtree(here / part, ignore_errors=True)
        (here / "status").write_text(str(status), encoding="utf-8")
    wrong = (
        []
        if (here / "status").read_text() == "0"
        else [f"iapb reproduce failed: {folder / name / 'report.log'}"]
    )
    try:
        found = compare_reports(read_numbers(folder / "default" / "report"), read_numbers(here))
    except IapbError as missing:
        return {"outcomes": 0, "outcomes equal": 0, "wrong": [*wrong, str(missing)]}
    outcomes = [
        cell
        for cell in found.cells
        if cell.state != TIMING
        and (cell.column in JUDGED or isinstance(cell.old, bool) or isinstance(cell.new, bool))
    ]
    other = [
        f"{cell.table}, {cell.row}: {cell.old} became {cell.new}"
        for cell in outcomes
        if cell.state != EXACT
    ]
    wrong += other + [
        f"table in one report only: {one}" for one in found.tables_old + found.tables_new
    ]
    return {"outcomes": len(outcomes), "outcomes equal": len(outcomes) - len(other), "wrong": wrong}


PARTS = {"tests": run_tests, "runs": run_runs, "report": run_report}


def child_facts(path: Path) -> None:
    """Write which libraries and processor features this process really uses."""
    import math

    import scipy.linalg  # noqa: F401 - loads its own BLAS
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
    from threadpoolctl import threadpool_info

    from iapb.numerics.library import PATH, library, manifest_of

    library()  # made again if it is for another processor
    blas = [one for one in threadpool_info() if one["user_api"] == "blas"]
    sines = np.array([math.sin(k / 997.0) for k in range(20_000)])
    facts = {
        "blas": sorted({str(one.get("architecture")) for one in blas}),
        "threads": max(one["num_threads"] for one in blas),
        "features": [key for key, there in __cpu_features__.items() if there],
        "optional": [key for key in __cpu_dispatch__ if __cpu_features__[key]],
        "engine": manifest_of(PATH)["stamp"].split()[1],
        "libm": hashlib.sha256(sines.tobytes()).hexdigest(),
    }
    path.write_text(json.dumps(facts), encoding="utf-8")


def child_runs(path: Path) -> None:
    """Compute every run and the impacts; write hashes to `path` and arrays next to it."""
    found = {}
    for label, kind, arrays in [*_runs(), *_impacts()]:
        hashes = {
            key: hashlib.sha256(f"{x.dtype}{x.shape}".encode() + x.tobytes()).hexdigest()
            for key, x in arrays
        }
        found[label] = {"kind": kind, "hashes": hashes}
        np.savez(path.with_name(f"{label}.npz"), **dict(arrays))
    path.write_text(json.dumps(found), encoding="utf-8")


def _runs() -> Iterator[tuple[str, str, list[tuple[str, Any]]]]:
    """Yield label, kind of world and arrays of each run, or the message of a world that refuses the
    scene."""
    from iapb import IapbError, find_scene, load_scene
    from iapb.scene import scene_names
    from reference.worlds import WORLDS, find_world, run_world

    renderings = [("IAPB", rendering) for rendering in ("saturate", "scale", "spread")]
    for name in scene_names():
        scene = load_scene(find_scene(name))
        for world, rendering in [*((world, "full") for world in WORLDS), *renderings]:
            kind = (
                "engine" if type(find_world(world).law).__module__.startswith("iapb.") else "other"
            )
            try:
                run = run_world(scene, world, rendering, partial=True)
                arrays = [("distrust", np.array("; ".join(run.distrust))), *results_of(run)]
            except IapbError as refused:
                arrays = [("refused", np.array(str(refused)))]
            yield f"{name}-{world}-{rendering}", kind, arrays


def _impacts() -> Iterator[tuple[str, str, list[tuple[str, Any]]]]:
    """Yield impacts with integer input, which is the same on every machine."""
    from iapb import resolve_impact

    rng = np.random.default_rng(0)
    for number in range(IMPACTS):
        d = int(rng.integers(1, 31))
        c = int(rng.integers(1, 61))
        factor = rng.integers(-3, 4, size=(d, d))
        mass = np.ldexp(
            (factor @ factor.T + np.eye(d, dtype=int)).astype(float), int(rng.integers(-9, 10))
        )
        rank = int(rng.integers(1, min(c, d) + 1))
        rows = (rng.integers(-3, 4, size=(c, rank)) @ rng.integers(-9, 10, size=(rank, d))).astype(
            float
        )
        e = rng.integers(0, 9) / 8.0 if number % 4 else rng.integers(0, 9, size=c) / 8.0
        impact = resolve_impact(mass, rows, rng.integers(-99, 100, size=d) / 64.0, e)
        yield (
            f"impact-{number}",
            "engine",
            [
                (key, np.asarray(value))
                for key, value in impact._asdict().items()
                if isinstance(value, np.ndarray | float | int | tuple)
            ],
        )


CHILDREN = {"facts": child_facts, "runs": child_runs}


def table(rows: list[dict[str, Any]]) -> str:
    """Return the table of settings as text, followed by the differences found."""
    heads = (
        "setting",
        "BLAS",
        "tests passed/failed",
        "outcomes equal",
        "engine runs equal",
        "other runs equal",
        "largest difference",
        "of q",
        "result",
    )
    wrong = [f"{row['setting']}: {one}" for row in rows for one in row["wrong"][:20]]
    return "\n".join([table_text(titled(heads, map(_line, rows))), "", *wrong])


def _line(row: dict[str, Any]) -> tuple[str, ...]:
    if "not tried" in row:
        return (row["setting"], "-", *("-",) * 6, f"not tried: {row['not tried']}")
    tests, runs, report = (row.get(part, {}) for part in PARTS)
    return (
        row["setting"],
        "/".join(row["facts"]["blas"]),
        f"{tests['passed']}/{tests['failed']}" if tests else "-",
        f"{report['outcomes equal']}/{report['outcomes']}" if report else "-",
        *(
            f"{runs[f'{kind} equal']}/{runs[kind]}" if kind in runs else "-"
            for kind in ("engine", "other")
        ),
        *(f"{runs[key]:.1e}" if key in runs else "-" for key in ("largest", "largest q")),
        "WRONG" if row["wrong"] else "the same",
    )


if __name__ == "__main__":
    sys.exit(main())
