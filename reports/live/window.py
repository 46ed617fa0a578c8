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
# The first numbers of the page: sequence numbers of the pose and of the wish, and the wish; the pose follows them.
SHOWN, WANTED, HELD, BEAT, TARGET, POSE = 0, 1, 2, 3, slice(4, 7), 7


class Window:
    """The shared memory for a pose of `numbers` numbers; without a `name` it is created, and removed on `close`."""

    def __init__(self, numbers: int, name: str = "") -> None:
        self._memory = SharedMemory(name or None, create=not name, size=8 * (POSE + numbers))
        self._owner, self.numbers, self.name = not name, numbers, self._memory.name
        self.page = np.ndarray(POSE + numbers, np.float64, self._memory.buf)  # zeros at first

    # the loop's side

    def publish(self, pose: Floats) -> None:
        """Write the current pose."""
        self.page[SHOWN] += 1
        self.page[POSE:] = pose
        self.page[SHOWN] += 1

    def target(self, now: float, before: Floats | None) -> Floats | None:
        """Return the target of the hand (3,) [m]; None if the mouse holds nothing or the viewer is silent.

        While the viewer is writing, return `before`.
        """
        wish = self.page[:POSE].copy()
        if now - wish[BEAT] > SILENCE_SECONDS:
            return None
        if wish[WANTED] % 2 or wish[WANTED] != self.page[WANTED]:
            return before
        return wish[TARGET] if wish[HELD] else None

    # the viewer's side

    def shown(self) -> Floats | None:
        """Return the last complete pose; None if the loop died during a write."""
        for _ in range(_ATTEMPTS):
            sequence = self.page[SHOWN]
            pose = self.page[POSE:].copy()
            if sequence % 2 == 0 and sequence == self.page[SHOWN]:
                return pose
        return None

    def want(self, target: Floats | None, now: float) -> None:
        """Write the target of the hand (3,) [m], or None to let go; the time `now` shows that the viewer is alive."""
        self.page[WANTED] += 1
        self.page[HELD], self.page[BEAT] = target is not None, now
        if target is not None:
            self.page[TARGET] = target
        self.page[WANTED] += 1

    def close(self) -> None:
        """Release the shared memory; no process may use it after its creator has closed it."""
        del self.page
        self._memory.close()
        if self._owner:
            self._memory.unlink()
