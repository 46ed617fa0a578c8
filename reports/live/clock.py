"""The clock that the loop keeps to: asleep until shortly before an instant, then watching for it."""

from __future__ import annotations

import time
from typing import Protocol

# Linux wakes a sleeper some 50 µs late, so the last stretch is spent awake; more would only heat the processor.
SPIN_SECONDS = 1e-4


class Clock(Protocol):
    """Anything that tells the time and waits; tests bring one of their own."""

    def now(self) -> float:
        """Return the time [s]; it never goes back."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return at `instant` [s] or, where that has passed, at once."""
        ...


class MonotonicClock:
    """CLOCK_MONOTONIC: the same in all processes of this machine, and nobody can set it."""

    def now(self) -> float:
        """Return the time [s] since some fixed instant."""
        return time.monotonic()

    def wait_until(self, instant: float) -> None:
        """Sleep to `SPIN_SECONDS` before the instant, then spin."""
        asleep = instant - time.monotonic() - SPIN_SECONDS
        if asleep > 0.0:
            time.sleep(asleep)
        while time.monotonic() < instant:
            pass
