"""The compiled loop, and one step of it in its parts as Python enters them.

A step has two halves, with the world's own time between them where a device is real:

    begin    hand and coupling pull, the law advances, what the device is to give is known and given
    end      the device has moved: by its kernel, or by itself, and is read
"""

from __future__ import annotations

from typing import Any

from iapb.compiled import Entry, kernel
from iapb.contact.kernels.step import STATUS_TEXT, advance
from iapb.errors import IapbError
from iapb.haptics.external import DeviceLink
from iapb.haptics.kernels import couple, drive_device, move_device, render
from iapb.haptics.kernels.port import NO_COUPLING
from iapb.recording import Record, write_step

DEVICE_NOT_FINITE = 1 + max(STATUS_TEXT)
FAILURES = STATUS_TEXT | {DEVICE_NOT_FINITE: "the device's motion left the range of numbers: the step is too long "
                                             "for this coupling and delay"}


@kernel
def compiled_steps(  # type: ignore[no-untyped-def]
    world, state, port, record, first, steps
):
    """Do `steps` steps of an engine law; return (steps done, status)."""
    for k in range(steps):
        couple(world, state, port)
        status = advance(world, state, port.applied)
        if status:
            return k, status
        if not drive_device(world, state, port):
            return k, DEVICE_NOT_FINITE
        write_step(record, k, first + k, state, port)
    return steps, 0


class Stepper:
    """The parts of a step of one simulation, entered without numba's look-up of types (some 10 µs a call).

    Parameters
    ----------
    world, state, port : the simulation's blocks; they stay the same.
    link : to a device of its own; None: the compiled device.
    """

    def __init__(self, world: Any, state: Any, port: Any, link: DeviceLink | None) -> None:
        self._blocks, self._link = (world, state, port), link
        self._couple: Any = Entry(couple)
        self._advance: Any = Entry(advance)
        self._render: Any = Entry(render)
        self._move: Any = Entry(move_device)
        self._write: Any = Entry(write_step)

    def prepare(self, record: Record) -> None:
        """Find the machine code of every part now, which takes milliseconds, rather than in the first step."""
        world, state, port = blocks = self._blocks
        self._couple = Entry(couple).taking(*blocks)
        self._advance = Entry(advance).taking(world, state, port.applied)
        self._render, self._move = Entry(render).taking(*blocks), Entry(move_device).taking(*blocks)
        self._write = Entry(write_step).taking(record, 0, 0, state, port)

    def couple(self) -> None:
        """Forces of the hand and of the coupling on the tool: into ``port.applied``."""
        self._couple(*self._blocks)

    def advance(self) -> None:
        """Advance an engine law by one step; raise IapbError where that cannot be done."""
        world, state, port = self._blocks
        status = self._advance(world, state, port.applied)
        if status:
            raise IapbError(FAILURES[status])

    def render(self) -> None:
        """What the device is to give (26); a device of its own is told so."""
        self._render(*self._blocks)
        if self._link is not None:
            self._link.send()

    def finish(self) -> None:
        """The device moves; one of its own is read."""
        if self._link is not None:
            self._link.receive()
        elif self._blocks[2].coupling != NO_COUPLING and not self._move(*self._blocks):
            raise IapbError(FAILURES[DEVICE_NOT_FINITE])

    def write(self, record: Record, k: int, step: int) -> None:
        """Copy step number `step` into line k of the chunk."""
        self._write(record, k, step, *self._blocks[1:])
