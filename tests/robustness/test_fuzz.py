"""Wrong input of every kind: read, or refused by one of iapb's errors; never a traceback, a hang or endless memory.

`inputs` says what is damaged and who reads it, `damage` how. What breaks something stays in the folder of the test.
"""

from __future__ import annotations

import resource
import signal
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from iapb.errors import IapbError
from tests.robustness.inputs import KINDS, TIMES, prepare

pytestmark = pytest.mark.thorough

READ, REFUSED, BROKEN = "read", "refused", "broken"
LONGEST = 20.0  # [s] of this process's own time; a case takes milliseconds, the largest legal file a few seconds
_MEMORY = 4 << 30  # bytes beyond what the process has: a wrong file may not ask for more


class TooLong(BaseException):
    """A case took longer than LONGEST. Not an Exception: no reader may catch it."""


def judge(read: Callable[[Path], Any], path: Path, content: bytes) -> tuple[str, str]:
    """Write a case and let it be read; return the outcome and what was said."""
    path.write_bytes(content)
    try:
        with bounded_time():
            read(path)
    except IapbError as error:
        return REFUSED, str(error)
    except KeyboardInterrupt:
        raise
    except BaseException:  # whatever comes is the finding
        return BROKEN, traceback.format_exc()
    return READ, ""


@contextmanager
def bounded_time() -> Iterator[None]:
    """Stop what runs longer than LONGEST, counted in this process's own time: a busy machine is no hang."""
    def stop(*_: object) -> None:
        raise TooLong

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


@pytest.fixture
def bounded_memory() -> Iterator[None]:
    """Let memory grow by _MEMORY at most."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + _MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@pytest.mark.usefixtures("bounded_memory")
@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
def test_wrong_input_is_read_or_refused_and_valid_input_is_read(kind: Any, tmp_path: Path) -> None:
    prepare(tmp_path)
    samples, outcomes = kind.samples(), Counter[str]()
    for name, content in samples.items():
        outcome, words = judge(kind.read, tmp_path / name, content)
        assert outcome == READ or kind.name == "command lines", words  # some lines are wrong on purpose

    @settings(max_examples=kind.cases * TIMES, phases=[Phase.generate], database=None)
    @given(st.integers(0, 2**64 - 1), st.sampled_from(sorted(samples)), st.sampled_from(sorted(samples)))
    def damaged(seed: int, name: str, other: str) -> None:
        content = kind.damaged(samples[name], samples[other], np.random.default_rng(seed))
        outcome, words = judge(kind.read, tmp_path / name, content)
        assert outcome != BROKEN, words
        outcomes[outcome] += 1

    damaged()
    assert outcomes[REFUSED] >= outcomes.total() // 4, "damage too mild to try anything"


def test_a_careless_reader_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The planted faults: a traceback and a swallowed hang; and one that is right."""
    def careless(path: Path) -> None:
        raise KeyError(path.name)

    def endless(path: Path) -> None:
        while True:
            try:
                sum(range(1000))
            except Exception:
                continue

    def polite(path: Path) -> None:
        raise IapbError("no")

    monkeypatch.setattr("tests.robustness.test_fuzz.LONGEST", 0.1)
    assert [judge(reader, tmp_path / "x", b"")[0] for reader in (careless, endless, polite)] == [
        BROKEN, BROKEN, REFUSED]  # fmt: skip
