"""A pytest plugin: which functions of the engine each test calls, its outcome, and how many CPU seconds it takes.

Tests that are slow with interpreted kernels are stopped: they would judge mutants too slowly. What a shared fixture
calls is noted at the first test that uses it; therefore a survivor is judged again by whole files.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

SLOWEST_TEST = 4.0  # [s] of CPU, traced
LONGEST_FILE = 40.0  # [s]; what comes later in a file is left out
RESULT = "IAPB_MUTANTS_CALLS"  # environment variable: the file to write


class _TooSlow(BaseException):
    """No Exception: hypothesis would take it for a failure of the test and search for a smaller one."""


class Calls:
    """The plugin."""

    def __init__(self) -> None:
        self.tests: dict[str, dict[str, Any]] = {}
        self._seen: dict[int, CodeType] = {}
        self._spent: defaultdict[str, float] = defaultdict(float)

    def _trace(self, frame: FrameType, event: str, argument: Any) -> None:
        self._seen[id(frame.f_code)] = frame.f_code

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, Any, Any]:
        """Trace the calls of one test with its fixtures."""
        file = item.nodeid.split("::")[0]
        if self._spent[file] > LONGEST_FILE:
            return True  # as if it had run; without a report it is no test that passes
        self._seen = {}
        self.tests[item.nodeid] = {"passed": True}
        begin = time.process_time()
        sys.settrace(self._trace)
        try:
            return (yield)
        finally:
            sys.settrace(None)
            seconds = round(time.process_time() - begin, 3)
            self._spent[file] += seconds
            self.tests[item.nodeid].update(seconds=seconds, calls=sorted(self._of_engine()))

    @pytest.hookimpl(wrapper=True)
    def pytest_pyfunc_call(self, pyfuncitem: pytest.Function) -> Generator[None, Any, Any]:
        """Stop a slow test; only inside its own function, where pytest takes that for a failure."""
        signal.signal(signal.SIGVTALRM, _stop)
        signal.setitimer(signal.ITIMER_VIRTUAL, SLOWEST_TEST)
        try:
            return (yield)
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A test counts only if all its phases pass (a skipped one does not)."""
        if not report.passed:
            self.tests[report.nodeid]["passed"] = False

    def pytest_sessionfinish(self) -> None:
        """Write what was seen."""
        Path(os.environ[RESULT]).write_text(json.dumps(self.tests))

    def _of_engine(self) -> set[str]:
        root = Path.cwd()
        return {
            f"{Path(code.co_filename).relative_to(root)}::{code.co_qualname}"
            for code in self._seen.values()
            if code.co_filename.startswith(f"{root}/iapb/")
        }


def _stop(number: int, frame: FrameType | None) -> None:
    raise _TooSlow


def pytest_configure(config: pytest.Config) -> None:
    """Register the plugin when it is asked for by its environment variable."""
    if RESULT in os.environ:
        config.pluginmanager.register(Calls())
