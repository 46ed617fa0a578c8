"""The parts of a step, each repeated in compiled code; apart, so that numba is imported only where it runs."""

from __future__ import annotations

from typing import Any

from iapb.compiled import kernel
from iapb.contact.kernels.collide import resolve_collisions
from iapb.contact.kernels.step import clear, find_contacts, locate, move
from iapb.haptics.kernels import couple, drive_device
from iapb.recording import write_step

# in the order in which `repeat_part` numbers them
PARTS = ("hand and coupling", "bodies placed", "contacts found", "collisions", "forces and motion", "device", "record")


@kernel
def repeat_part(world: Any, state: Any, port: Any, record: Any, part: Any, times: Any) -> None:
    """Do one part of the step `times` times; on a scene at rest each time is like the one before."""
    for k in range(times):
        if part == 0:
            couple(world, state, port)
        elif part == 1:
            clear(state)
            locate(world, state)
        elif part == 2:
            find_contacts(world, state)
        elif part == 3:
            resolve_collisions(world, state)
        elif part == 4:
            state.penalty_force[:] = 0.0
            state.friction_force[:] = 0.0
            move(world, state, port.applied)
        elif part == 5:
            drive_device(world, state, port)
        else:
            write_step(record, k, k, state, port)
