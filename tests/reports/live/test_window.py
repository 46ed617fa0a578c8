"""The page between loop and viewer: what is read is whole, and who has died is not waited for."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from reports.live.window import SHOWN, SILENCE_SECONDS, TARGET, WANTED, Window

NOW = 5.0


@pytest.fixture
def sides():
    """The loop's side and the viewer's."""
    ours = Window(4)
    theirs = Window(4, ours.name)
    yield ours, theirs
    theirs.close()
    ours.close()


def test_each_side_reads_what_the_other_wrote(sides):
    ours, theirs = sides
    ours.publish(np.array([1.0, 2.0, 3.0, 4.0]))
    assert theirs.shown().tolist() == [1.0, 2.0, 3.0, 4.0]
    assert ours.target(NOW, None) is None
    theirs.want(np.array([0.1, 0.2, 0.3]), NOW)
    assert ours.target(NOW, None).tolist() == [0.1, 0.2, 0.3]
    theirs.want(None, NOW)
    assert ours.target(NOW, np.zeros(3)) is None


def test_what_is_read_is_never_half_of_two_writes(sides):
    ours, theirs = sides
    stop, torn, read = threading.Event(), [], 0

    def write():
        k = 0.0
        while not stop.is_set():
            k += 1.0
            ours.publish(np.full(4, k))

    writer = threading.Thread(target=write)
    writer.start()
    for _ in range(3000):
        q = theirs.shown()
        if q is not None:
            read += 1
            torn += [q] if np.any(q != q[0]) else []
    stop.set()
    writer.join()
    assert read > 0 and not torn


def test_a_viewer_that_died_while_writing_is_not_waited_for(sides):
    ours, theirs = sides
    theirs.want(np.array([0.1, 0.2, 0.3]), NOW)
    before = ours.target(NOW, None)
    theirs.page[WANTED] += 1  # it begins to write, and that was that
    theirs.page[TARGET] = 9.0
    assert ours.target(NOW, before) is before
    assert ours.target(NOW + 1.01 * SILENCE_SECONDS, before) is None  # the hand lets go


def test_a_loop_that_died_while_writing_is_not_waited_for(sides):
    ours, theirs = sides
    ours.page[SHOWN] += 1
    assert theirs.shown() is None
