"""The shared memory of the loop and its viewer; either process may read while the other writes, without a lock.

Each half has one writer and a sequence number, which is odd during a write. A reader uses its data only if the number
was even and did not change during the read. The loop tries once and continues; only the viewer tries again. So a
viewer that sleeps, hangs or dies, even during a write, does not delay the loop. If the viewer does not write for
`SILENCE_SECONDS`, the hand lets go.

(This requires that writes become visible in program order, as on x86, and that each number is written atomically.)
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
    """The shared memory; create it with `made`, open it in the other process with `opened`."""

    def __init__(self, memory: SharedMemory, numbers: int, owner: bool) -> None:
        self._memory, self._owner, self.numbers = memory, owner, numbers
        self._sequence = np.ndarray(_HEAD, np.int64, memory.buf)
        page = np.ndarray(_WISHES + numbers, np.float64, memory.buf, _HEAD * _WORD)
        self._wishes, self._pose = page[:_WISHES], page[_WISHES:]

    @classmethod
    def made(cls, numbers: int) -> Window:
        """Create a shared memory for poses of `numbers` numbers; its creator removes it on `close`."""
        size = _WORD * (_HEAD + _WISHES + numbers)
        window = cls(SharedMemory(create=True, size=size), numbers, owner=True)
        window._sequence[:] = 0
        window._wishes[:] = 0.0
        window._pose[:] = 0.0
        return window

    @classmethod
    def opened(cls, name: str, numbers: int) -> Window:
        """Open the shared memory that another process has created."""
        return cls(SharedMemory(name), numbers, owner=False)

    @property
    def name(self) -> str:
        """Return the name by which the other process opens the shared memory."""
        return self._memory.name

    # the loop's side

    def publish(self, pose: Floats) -> None:
        """Write the current pose."""
        self._sequence[_SHOWN] += 1
        self._pose[:] = pose
        self._sequence[_SHOWN] += 1

    def target(self, now: float, before: Floats | None) -> Floats | None:
        """Return the target of the hand (3,) [m]; None if the mouse holds nothing or the viewer is silent.

        While the viewer is writing, return `before`.
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
        """Return the last complete pose; None if the loop died during a write."""
        for _ in range(_ATTEMPTS):
            sequence = int(self._sequence[_SHOWN])
            pose = self._pose.copy()
            if sequence % 2 == 0 and sequence == int(self._sequence[_SHOWN]):
                return pose
        return None

    def want(self, target: Floats | None, now: float) -> None:
        """Write the target of the hand (3,) [m], or None to let go; the time `now` shows that the viewer is alive."""
        self._sequence[_WANTED] += 1
        self._wishes[_HELD], self._wishes[_BEAT] = float(target is not None), now
        if target is not None:
            self._wishes[_TARGET] = target
        self._sequence[_WANTED] += 1

    def close(self) -> None:
        """Release the shared memory; no process may use it after its creator has closed it."""
        del self._sequence, self._wishes, self._pose
        self._memory.close()
        if self._owner:
            self._memory.unlink()
