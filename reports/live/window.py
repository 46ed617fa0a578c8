"""What the loop and its viewer share: a page of memory that either may read while the other writes, without a lock.

Each half has a sequence number, odd while its one writer is at work: the reader takes what it read only if the number
was even and the same before and after. The loop tries once and goes on; only the viewer tries again. So a viewer that
sleeps, hangs or dies, even in the middle of writing, costs the loop nothing; after `SILENCE_SECONDS` without a sign of
life from it the hand lets go.

(Stores become visible in the order in which they are made: so it is on x86, and Python makes each one whole.)
"""

from __future__ import annotations

from multiprocessing.shared_memory import SharedMemory

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SILENCE_SECONDS = 0.5
_ATTEMPTS = 20  # of the viewer; a write takes a microsecond, so more than a few mean that the loop has died
_WORD = 8
_SHOWN, _WANTED = 0, 1  # sequence numbers: of where everything is, of where the hand should be
_HEAD = 2
_HELD, _BEAT, _TARGET = 0, 1, slice(2, 5)
_WISHES = 5


class Window:
    """The shared page; make it with `made`, open it in the other process with `opened`."""

    def __init__(self, memory: SharedMemory, numbers: int, owner: bool) -> None:
        self._memory, self._owner, self.numbers = memory, owner, numbers
        self._sequence = np.ndarray(_HEAD, np.int64, memory.buf)
        page = np.ndarray(_WISHES + numbers, np.float64, memory.buf, _HEAD * _WORD)
        self._wishes, self._pose = page[:_WISHES], page[_WISHES:]

    @classmethod
    def made(cls, numbers: int) -> Window:
        """Make a page for poses of so many numbers; the maker closes it for all."""
        size = _WORD * (_HEAD + _WISHES + numbers)
        window = cls(SharedMemory(create=True, size=size), numbers, owner=True)
        window._sequence[:] = 0
        window._wishes[:] = 0.0
        window._pose[:] = 0.0
        return window

    @classmethod
    def opened(cls, name: str, numbers: int) -> Window:
        """Open the page that another process has made."""
        return cls(SharedMemory(name), numbers, owner=False)

    @property
    def name(self) -> str:
        """What the other process opens it by."""
        return self._memory.name

    # the loop's side

    def publish(self, pose: Floats) -> None:
        """Write where everything is."""
        self._sequence[_SHOWN] += 1
        self._pose[:] = pose
        self._sequence[_SHOWN] += 1

    def target(self, now: float, before: Floats | None) -> Floats | None:
        """Return where the hand should be (3,), None where it holds nothing or nobody has been there of late.

        While the viewer writes, the answer is that of `before`.
        """
        sequence = int(self._sequence[_WANTED])
        wishes = self._wishes.copy()
        if now - wishes[_BEAT] > SILENCE_SECONDS:
            return None
        if sequence % 2 or sequence != int(self._sequence[_WANTED]):
            return before
        return wishes[_TARGET] if wishes[_HELD] else None

    # the viewer's side

    def shown(self) -> Floats | None:
        """Return the last pose published whole; None: the loop is gone, in the middle of writing."""
        for _ in range(_ATTEMPTS):
            sequence = int(self._sequence[_SHOWN])
            pose = self._pose.copy()
            if sequence % 2 == 0 and sequence == int(self._sequence[_SHOWN]):
                return pose
        return None

    def want(self, target: Floats | None, now: float) -> None:
        """Write where the hand should be (3,), None: it lets go; also the viewer's sign of life."""
        self._sequence[_WANTED] += 1
        self._wishes[_HELD], self._wishes[_BEAT] = float(target is not None), now
        if target is not None:
            self._wishes[_TARGET] = target
        self._sequence[_WANTED] += 1

    def close(self) -> None:
        """Give the page back; nobody may use it after its maker has closed it."""
        del self._sequence, self._wishes, self._pose
        self._memory.close()
        if self._owner:
            self._memory.unlink()
