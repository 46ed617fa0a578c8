"""`make mutants`: mutation testing of the physics modules. Tests must detect small faults, inserted one at a time.

A sample of the faults is tested in temporary clones of the last commit, with interpreted kernels
(NUMBA_DISABLE_JIT=1), and the share of detected faults is printed. A fault that no test detects is either a gap in the
tests or an irrelevant change; irrelevant changes are listed with reasons in mutants.toml.

1. Every test file runs once under a tracer: which functions of the physics does each test call, and in what time?
2. `places` lists where a fault can be put (see `faults`); a hash of the place and the seed draws the sample.
3. One file of a clone is changed. The tests that call the changed function run, the quick ones first, and if all of
   them pass the whole test files that touch it.

What was measured and judged is kept in out/mutants: a sample can be stopped and gone on with.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import multiprocessing
import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[1]
OUT, TABLE = REPOSITORY / "out" / "mutants", Path(__file__).with_suffix(".toml")
PHYSICS = ("iapb/mechanics/kernels/*.py", "iapb/mechanics/mechanism.py", "iapb/mechanics/integrators.py",
           "iapb/mechanics/energy.py", "iapb/contact/kernels/*.py", "iapb/contact/impact_methods.py",
           "iapb/haptics/kernels.py")  # fmt: skip
TESTS = ("tests/iapb", "tests/verification/mechanics", "tests/verification/laws")
WANTED = 0.90
NOTICED, TOO_LONG, SURVIVED, UNREACHED = "noticed", "too long", "survived", "unreached"

# --- faults -------------------------------------------------------------------------------------------------------

_BINARY = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
_COMPARED = {ast.Lt: ("<", "<=", ">="), ast.LtE: ("<=", "<", ">"), ast.Gt: (">", ">=", "<="), ast.GtE: (">=", ">", "<"),
             ast.Eq: ("==", "!="), ast.NotEq: ("!=", "==")}  # fmt: skip
_JOINED = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
_NAMES = {"min": "max", "max": "min"}
# Arrays of one entry, as the records of the kernels declare them: `clock: np.ndarray  # (1,) int64`.
_DECLARED = re.compile(r"^ +(\w+): np\.ndarray  # \(1,\)", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """One fault: the bytes from start to stop of one file are replaced."""

    file: str
    function: str  # qualified name; empty outside of all functions
    number: int  # of the line
    line: str
    becomes: str
    fault: str
    start: int
    stop: int
    new: str

    def source(self, text: str) -> str:
        """Return the file's text with the fault."""
        content = text.encode()
        return (content[: self.start] + self.new.encode() + content[self.stop :]).decode()


def faults(tree: ast.AST, content: bytes, one_entry: frozenset[str]) -> Iterator[tuple[str, int, int, str]]:
    """Yield (kind, start, stop, new text) of every fault: changed operators, numbers ± 1, removed statements …"""
    begins = [0, *(found.end() for found in re.finditer(rb"\n", content))]

    def start(node: Any) -> int:
        return begins[node.lineno - 1] + int(node.col_offset)

    def stop(node: Any) -> int:
        return begins[node.end_lineno - 1] + int(node.end_col_offset)

    def between(left: int, right: int, old: str, new: Sequence[str], kind: str) -> Iterator[tuple[str, int, int, str]]:
        at = content.index(old.encode(), left, right)
        yield from ((kind, at, at + len(old), other) for other in new)

    for node in _code(tree):
        match node:
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                old, *new = _BINARY[type(op)]
                yield from between(stop(left), start(right), old, new, "operator")
            case ast.AugAssign(target=target, op=op, value=value):
                if type(op) in _BINARY:
                    old, *new = _BINARY[type(op)]
                    yield from between(stop(target), start(value), old, new, "operator")
                yield "dropped", start(node), stop(node), "pass"
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                for before, op, after in zip([left, *comparators], ops, comparators, strict=False):
                    if type(op) in _COMPARED:
                        old, *new = _COMPARED[type(op)]
                        yield from between(stop(before), start(after), old, new, "comparison")
            case ast.BoolOp(op=op, values=values):
                old, *new = _JOINED[type(op)]
                for before, after in zip(values, values[1:], strict=False):
                    yield from between(stop(before), start(after), old, new, "and, or")
            case ast.UnaryOp(op=ast.USub() | ast.Not() as op):
                yield "sign", start(node), start(node) + (1 if isinstance(op, ast.USub) else len("not ")), ""
            case ast.Constant(value=bool() as value):
                yield "truth", start(node), stop(node), str(not value)
            case ast.Constant(value=int() | float() as value) if value + 1 != value:
                yield "number", start(node), stop(node), repr(value + 1)
                array = re.search(rb"(\w+)\[$", content[max(0, start(node) - 80) : start(node)]) if value == 0 else None
                if array is None or array[1].decode() not in {*one_entry, "shape"}:  # else its last entry is its first
                    yield "number", start(node), stop(node), repr(value - 1)
            case ast.Break() | ast.Continue():
                yield "loop", start(node), stop(node), "continue" if isinstance(node, ast.Break) else "break"
            case ast.Call(func=ast.Name(id=name) as called) if name in _NAMES:
                yield "extreme", start(called), stop(called), _NAMES[name]
            case ast.Expr(value=ast.Call()):
                yield "dropped", start(node), stop(node), "pass"


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """Yield every node except type hints of records, raise statements and format strings, which need no test."""
    for child in ast.iter_child_nodes(node):
        hint = isinstance(child, ast.AnnAssign) and child.value is None
        if not (hint or isinstance(child, ast.Raise | ast.JoinedStr)):
            yield child
            yield from _code(child)


def functions(tree: ast.AST, prefix: str = "") -> Iterator[tuple[str, range]]:
    """Yield the qualified name of each function, and its lines."""
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, ast.FunctionDef):
            yield f"{prefix}{child.name}", range(child.lineno, (child.end_lineno or child.lineno) + 1)
            yield from functions(child, f"{prefix}{child.name}.<locals>.")
        elif isinstance(child, ast.ClassDef):
            yield from functions(child, f"{prefix}{child.name}.")


def places(file: str, text: str, one_entry: frozenset[str] = frozenset()) -> Iterator[Mutant]:
    """Yield all mutants of one file."""
    tree, content, lines = ast.parse(text), text.encode(), text.splitlines()
    spans = sorted(functions(tree), key=lambda span: len(span[1]))
    for kind, start, stop, new in faults(tree, content, one_entry):
        number = content.count(b"\n", 0, start) + 1
        function = next((name for name, span in spans if number in span), "")
        changed = (content[:start] + new.encode() + content[stop:]).decode().splitlines()[number - 1].strip()
        yield Mutant(file, function, number, lines[number - 1].strip(), changed, kind, start, stop, new)


def all_places(root: Path, only: str = "") -> list[Mutant]:
    """Yield all mutants of the physics modules whose path contains `only`."""
    files = sorted({path for pattern in PHYSICS for path in root.glob(pattern)})
    one_entry = frozenset(name for path in files for name in _DECLARED.findall(path.read_text()))
    named = ((str(path.relative_to(root)), path) for path in files)
    return [mutant for file, path in named if only in file for mutant in places(file, path.read_text(), one_entry)]


def sample(mutants: Iterable[Mutant], count: int, seed: int) -> list[Mutant]:
    """Return the `count` mutants with the smallest hash of seed and content, which edits elsewhere do not change."""
    drawn: list[tuple[str, Mutant]] = []
    seen: Counter[tuple[str, ...]] = Counter()
    for mutant in mutants:
        content = (mutant.file, mutant.function, mutant.line, mutant.becomes)
        seen[content] += 1
        drawn.append((_stamp(repr((seed, content, seen[content]))), mutant))
    return [mutant for _, mutant in sorted(drawn, key=lambda pair: pair[0])[:count]]


def _stamp(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:20]


# --- clones and pytest in them --------------------------------------------------------------------------------------

PASSED, FAILED, TIMED_OUT, NO_TESTS = "passed", "failed", "timed out", "no tests"
# Every run of pytest is a process of its own, forked from a server that has loaded the big libraries once.
_PROCESSES = multiprocessing.get_context("forkserver")
_LOADED_ONCE = ["tools.mutants", "pytest", "hypothesis.extra.numpy", "numba.extending", "scipy.linalg", "pydantic",
                "scipy.spatial.transform", "ruamel.yaml"]  # fmt: skip
_START, _SLOWER = 20, 4  # [s] of CPU to start pytest, generously; a mutant that takes this many times as long hangs


def git(*arguments: str, folder: Path = REPOSITORY) -> str:
    """Return the output of a git command."""
    return subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


class Clone:
    """A clone of the last commit in a temporary folder; remove it after use."""

    def __init__(self) -> None:
        self.root = Path(tempfile.mkdtemp(prefix="mutants-"))
        git("clone", "-q", str(REPOSITORY), str(self.root))

    def pytest(self, arguments: Sequence[str], seconds: int, calls: str = "") -> tuple[str, str]:
        """Run pytest with a limit of CPU seconds; return its outcome and the first failure."""
        said = self.root / "said.txt"
        options = ["-q", "--tb=no", "-p", "no:cacheprovider", "-p", "tools.mutants", *arguments]
        process = _PROCESSES.Process(target=_run_pytest, args=(self.root, options, seconds, calls, said))
        process.start()
        process.join()
        code = process.exitcode or 0
        if code in (-signal.SIGXCPU, -signal.SIGKILL):
            return TIMED_OUT, ""
        if code in (0, 5):
            return (PASSED if code == 0 else NO_TESTS), ""
        text = said.read_text(errors="replace")
        if first := re.search(r"^(?:FAILED|ERROR) (\S+)", text, re.MULTILINE):
            return FAILED, first[1]
        last = (text.strip().splitlines() or ["?"])[-1]
        if code < 0 or re.search(r"\b[1-9]\d* (failed|error)", last):
            return FAILED, last if code > 0 else f"the interpreter ended by signal {-code}"
        raise RuntimeError(f"pytest did not run: {last}")


def _run_pytest(root: Path, options: Sequence[str], seconds: int, calls: str, said: Path) -> None:
    """Run pytest in a clone, in a new process with the large libraries loaded but not the engine."""
    import pytest

    os.environ[_CALLS] = calls
    os.chdir(root)
    sys.path.insert(0, str(root))
    output = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    code = int(pytest.main(list(options)))
    sys.stdout.flush()
    os._exit(code)


def prepare() -> None:
    """Set up all test processes: interpreted kernels, and one thread so that CPU time measures the work.

    No byte code is written, because it would be stale for a file that changes twice within a second.
    """
    os.environ.update(NUMBA_DISABLE_JIT="1", PYTHONDONTWRITEBYTECODE="1", OMP_NUM_THREADS="1",
                      OPENBLAS_NUM_THREADS="1", IAPB_HYPOTHESIS_PROFILE="quick")  # fmt: skip
    _PROCESSES.set_forkserver_preload(_LOADED_ONCE)


def in_clones(work: Callable[[Clone, Any], Any], things: Iterable[Any], clones: Sequence[Clone]) -> Iterator[Any]:
    """Yield the results of `work(clone, thing)` as they complete, one at a time in each clone."""
    free: queue.SimpleQueue[Clone] = queue.SimpleQueue()
    for clone in clones:
        free.put(clone)

    def one(thing: Any) -> Any:
        clone = free.get()
        try:
            return work(clone, thing)
        finally:
            free.put(clone)

    with ThreadPoolExecutor(len(clones)) as pool:
        tasks = [pool.submit(one, thing) for thing in things]
        try:
            for task in as_completed(tasks):
                yield task.result()
        finally:
            for task in tasks:
                task.cancel()


# --- the plugin of pytest: which functions of the engine does each test call? ----------------------------------------

_CALLS = "IAPB_MUTANTS_CALLS"  # environment variable: the file to write
_SLOWEST_TEST, _LONGEST_FILE = 4.0, 40.0  # [s] of CPU, traced; a slower test would judge mutants too slowly


class _TooSlow(BaseException):
    """A time limit was exceeded. It is no Exception, which hypothesis would treat as a failure and try to shrink."""


class Calls:
    """Records the calls, the outcome and the CPU seconds of each test.

    Calls of a shared fixture are recorded for the first test that uses it. Therefore undetected mutants are also tested
    by whole files.
    """

    def __init__(self) -> None:
        self.tests: dict[str, dict[str, Any]] = {}
        self._seen: dict[int, Any] = {}
        self._spent: defaultdict[str, float] = defaultdict(float)

    def _trace(self, frame: Any, event: str, argument: Any) -> None:
        self._seen[id(frame.f_code)] = frame.f_code

    def pytest_runtest_protocol(self, item: Any) -> Generator[None, Any, Any]:
        """Trace the calls of one test with its fixtures."""
        file = item.nodeid.split("::")[0]
        if self._spent[file] > _LONGEST_FILE:
            return True  # as if it had run; without a report it is no test that passes
        self._seen, begin = {}, time.process_time()
        self.tests[item.nodeid] = {"passed": True}
        sys.settrace(self._trace)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            seconds, inside = round(time.process_time() - begin, 3), f"{Path.cwd()}/iapb/"
            self._spent[file] += seconds
            calls = {f"{Path(code.co_filename).relative_to(Path.cwd())}::{code.co_qualname}"
                     for code in self._seen.values() if code.co_filename.startswith(inside)}  # fmt: skip
            self.tests[item.nodeid].update(seconds=seconds, calls=sorted(calls))

    def pytest_pyfunc_call(self, pyfuncitem: Any) -> Generator[None, Any, Any]:
        """Stop a slow test, only within its own function, where pytest counts this as a failure."""

        def stop(number: int, frame: Any) -> None:
            raise _TooSlow

        signal.signal(signal.SIGVTALRM, stop)
        signal.setitimer(signal.ITIMER_VIRTUAL, _SLOWEST_TEST)
        try:
            return (yield)
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Record whether all phases of a test passed; a skipped test does not count as passed."""
        if not report.passed:
            self.tests[report.nodeid]["passed"] = False

    def pytest_sessionfinish(self) -> None:
        """Write the record to its file."""
        Path(os.environ[_CALLS]).write_text(json.dumps(self.tests))


def pytest_configure(config: Any) -> None:
    """Trace calls if the environment names a file for them."""
    import pytest

    if os.environ.get(_CALLS):
        for hook in (Calls.pytest_runtest_protocol, Calls.pytest_pyfunc_call):
            pytest.hookimpl(wrapper=True)(hook)
        config.pluginmanager.register(Calls())


def pytest_collection() -> None:
    """Let hypothesis stop at the first counterexample; this runs after tests/conftest.py and before the tests."""
    from hypothesis import Phase, settings

    settings.register_profile("mutants", settings.default, phases=(Phase.explicit, Phase.generate))
    settings.load_profile("mutants")


# --- which tests judge a mutant, and its verdict ---------------------------------------------------------------------

FIRST_LOOK, SECOND_LOOK = 10.0, 40.0  # [s] of CPU for the tests of a mutant, as measured without one


@dataclass(frozen=True)
class MeasuredTest:
    """A test that passes with interpreted kernels, with its CPU seconds and the functions that it calls."""

    name: str
    seconds: float
    calls: frozenset[str]

    @property
    def file(self) -> str:
        """The file of the test."""
        return self.name.split("::")[0]


def measured(clones: Sequence[Clone], told: Callable[[str], None]) -> list[MeasuredTest]:
    """Return measurements of all tests; each version of a test file is measured once and its results are kept."""
    folder, root = OUT / "calls", clones[0].root
    folder.mkdir(parents=True, exist_ok=True)
    files = [str(path.relative_to(root)) for part in TESTS for path in sorted((root / part).rglob("test_*.py"))]
    results = {file: folder / f"{_stamp(file + (root / file).read_text())}.json" for file in files}

    def measure(clone: Clone, file: str) -> None:
        verdict, first = clone.pytest([file], 300, calls=str(results[file]))
        if not results[file].exists():
            raise RuntimeError(f"measuring {file}: {verdict} {first}")

    pending = [file for file in files if not results[file].exists()]
    for done, _ in enumerate(in_clones(measure, pending, clones), start=1):
        told(f"measuring test files: {done} of {len(pending)}")
    found = (entry for file in files for entry in json.loads(results[file].read_text()).items())
    tests = [MeasuredTest(name, one["seconds"], frozenset(one["calls"])) for name, one in found if one["passed"]]
    return sorted(tests, key=lambda test: (test.seconds, test.name))


def looks(mutant: Mutant, tests: Sequence[MeasuredTest]) -> tuple[list[MeasuredTest], list[MeasuredTest]]:
    """Return the quickest tests that call the mutant's function, its own test file first; then others of their files.

    For a constant, or a function newer than the measurement, these are the tests that call anything of its module.
    """
    calling = [test for test in tests if mutant.function and f"{mutant.file}::{mutant.function}" in test.calls]
    calling = calling or [test for test in tests if any(name.startswith(f"{mutant.file}::") for name in test.calls)]
    first = _within(sorted(calling, key=lambda test: Path(mutant.file).stem not in test.file), FIRST_LOOK)
    files, seen = {test.file for test in calling}, set(first)
    return first, _within([test for test in tests if test.file in files and test not in seen], SECOND_LOOK)


def _within(tests: Iterable[MeasuredTest], seconds: float) -> list[MeasuredTest]:
    chosen, total = [], 0.0
    for test in tests:
        if total + test.seconds <= seconds:
            chosen.append(test)
            total += test.seconds
    return chosen


@dataclass(frozen=True)
class Judgement:
    """The verdict on one mutant."""

    file: str
    function: str
    number: int
    line: str
    becomes: str
    verdict: str  # NOTICED; TOO_LONG: a test did not end; SURVIVED; UNREACHED: no interpreted test calls the function
    by: str = ""  # the test that noticed it
    tests: int = 0  # that passed
    key: str = ""  # of the mutated file
    code: str = ""  # of engine and tests at that time

    @property
    def killed(self) -> bool:
        """Whether a test failed or did not end."""
        return self.verdict in (NOTICED, TOO_LONG)


def kept_verdicts(path: Path, code: str) -> dict[str, Judgement]:
    """Return the verdicts still valid: a detected mutant's for the same file, others' for the same engine and tests."""
    lines = path.read_text().splitlines() if path.exists() else []
    judged = (Judgement(**json.loads(line)) for line in lines)
    return {old.key: old for old in judged if old.killed or old.code == code}


def judge(
    mutant: Mutant, tests: Sequence[MeasuredTest], clone: Clone, known: dict[str, Judgement], code: str
) -> Judgement:
    """Return the kept verdict or test the mutant; the clone is restored."""
    path = clone.root / mutant.file
    text = path.read_text()
    key = _stamp(mutant.file + mutant.source(text))
    if key in known:
        return known[key]
    path.write_text(mutant.source(text))
    try:
        verdict, by, passed = _tried(mutant, tests, clone)
    finally:
        path.write_text(text)
    if verdict == NOTICED and "::" not in by and (clone.root / by).is_file():
        if clone.pytest(["--collect-only", by], _START)[0] == FAILED:
            raise RuntimeError(f"{by} cannot be collected, with or without a mutant")
    return Judgement(mutant.file, mutant.function, mutant.number, mutant.line, mutant.becomes, verdict, by, passed, key,
                     code)  # fmt: skip


def _tried(mutant: Mutant, tests: Sequence[MeasuredTest], clone: Clone) -> tuple[str, str, int]:
    """Return the verdict, the test that detected the mutant, and the number of passed tests."""
    passed = 0
    for chosen in filter(None, looks(mutant, tests)):
        patience = _START + round(_SLOWER * sum(test.seconds for test in chosen))
        outcome, first = clone.pytest(["-x", *(test.name for test in chosen)], patience)
        if outcome in (FAILED, TIMED_OUT):
            return (NOTICED if outcome == FAILED else TOO_LONG), first, passed
        if outcome == NO_TESTS:
            raise RuntimeError(f"pytest finds none of the tests chosen for {mutant.file}: {chosen[0].name}, …")
        passed += len(chosen)
    return (SURVIVED if passed else UNREACHED), "", passed


# --- the score --------------------------------------------------------------------------------------------------------


def explanation(one: Judgement, table: Sequence[dict[str, str]]) -> dict[str, str] | None:
    """Return the entry that explains why an undetected mutant is no gap in the tests, or None."""
    return next((entry for entry in table if (entry["file"], entry["line"]) == (one.file, one.line)
                 and entry.get("becomes", one.becomes) == one.becomes), None)  # fmt: skip


def score(judged: Sequence[Judgement], table: Sequence[dict[str, str]]) -> tuple[float, float, list[Judgement]]:
    """Return the share detected, the share without irrelevant mutants, and the undetected ones without explanation."""
    survivors = [one for one in judged if not one.killed]
    reasons = [explanation(one, table) for one in survivors]
    killed, equivalent = len(judged) - len(survivors), sum(why is not None and why["kind"] == "equivalent"
                                                          for why in reasons)  # fmt: skip
    unexplained = [one for one, why in zip(survivors, reasons, strict=True) if why is None]
    return killed / len(judged), killed / max(1, len(judged) - equivalent), unexplained


def sentences(judged: Sequence[Judgement], table: Sequence[dict[str, str]], number: int) -> Iterator[str]:
    """Yield the score per module, the undetected mutants with their lines, and the total score."""
    for file, count in sorted(Counter(one.file for one in judged).items()):
        yield f"{file}: {sum(one.killed for one in judged if one.file == file)} of {count} noticed"
    for one in sorted((one for one in judged if not one.killed), key=lambda one: (one.file, one.number)):
        why, tests = explanation(one, table), f"{one.tests} tests pass" if one.tests else "no interpreted test calls it"
        reason = f"{why['kind']}: {why['reason']}" if why else "NOT EXPLAINED"
        yield f"\n{one.file}:{one.number} in {one.function or 'the module'}, {tests}; {reason}"
        yield f"  - {one.line}\n  + {one.becomes}"
    share, changing, unexplained = score(judged, table)
    yield f"\n{share:.1%} of {len(judged)} mutants, drawn from {number}, were noticed; {changing:.1%} of those that " \
          f"change something. {len(unexplained)} survivors have no explanation."  # fmt: skip
    enough = changing >= WANTED and not unexplained
    yield f"{'Enough' if enough else 'Not enough'}: {WANTED:.0%} are wanted, and a reason for each survivor."


def main() -> int:
    """Return 1 if too few mutants are detected or an undetected mutant is not explained."""
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__.splitlines()[0])
    parser.add_argument("-n", dest="count", type=int, default=100, help="size of the sample")
    parser.add_argument("--seed", type=int, default=0, help="another seed draws another sample")
    parser.add_argument("--only", default="", metavar="PART", help="files whose path contains this")
    parser.add_argument("--workers", type=int, default=2, help="clones that are judged at once")
    asked = parser.parse_args()
    if git("status", "--porcelain", "--", "iapb", "tests"):
        print("Changes that are not committed are not judged: the clones hold the last commit.")
    prepare()
    clones = [Clone() for _ in range(asked.workers)]
    try:
        mutants, judged = all_places(clones[0].root, asked.only), _judged(asked, clones)
    finally:
        for clone in clones:
            shutil.rmtree(clone.root, ignore_errors=True)
    table = tomllib.loads(TABLE.read_text())["survivor"]
    print("\n".join(sentences(judged, table, len(mutants))))
    share, changing, unexplained = score(judged, table)
    content = {"commit": git("rev-parse", "HEAD"), "seed": asked.seed, "score": share,
               "mutants": [*map(asdict, judged)]}  # fmt: skip
    (REPOSITORY / "out" / "mutants.json").write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    return int(changing < WANTED or bool(unexplained))


def _judged(asked: argparse.Namespace, clones: Sequence[Clone]) -> list[Judgement]:
    def told(text: str) -> None:
        print(f"{text:<100}", end="\r" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)

    drawn, tests = sample(all_places(clones[0].root, asked.only), asked.count, asked.seed), measured(clones, told)
    code, path = _stamp(git("rev-parse", "HEAD:iapb", "HEAD:tests", folder=clones[0].root)), OUT / "verdicts.jsonl"
    known, judged = kept_verdicts(path, code), []
    for one in in_clones(lambda clone, mutant: judge(mutant, tests, clone, known, code), drawn, clones):
        judged.append(one)
        if one.key not in known:
            with path.open("a") as file:
                file.write(json.dumps(asdict(one)) + "\n")
        told(f"{len(judged)} of {len(drawn)} mutants: {one.file} {one.verdict}")
    return judged


if __name__ == "__main__":
    from tools.mutants import main as run  # under its own name, as the processes of the tests know it

    try:
        sys.exit(run())
    except KeyboardInterrupt:
        sys.exit("\nStopped. What was measured and judged is kept: the same command goes on from there.")
