"""Compiled loops around what is timed, so that no call from Python counts."""

from __future__ import annotations

from typing import Any

from iapb.compiled import kernel
from iapb.contact.kernels.collide import resolve_collisions
from iapb.contact.kernels.impact import factored_impact, rank_tolerance
from iapb.contact.kernels.step import clear, find_contacts, locate, move
from iapb.haptics.kernels import couple, drive_device
from iapb.mechanics.kernels.cholesky import cholesky
from iapb.recording import write_step


@kernel
def repeat_factored(
    mass: Any,
    lower: Any,
    v: Any,
    restitution: Any,
    columns: Any,
    tolerance: Any,
    work: Any,
    v_plus: Any,
    momentum: Any,
    calls: Any,
) -> None:
    """Resolve the same impact `calls` times, the copy of its rows into the scratch included."""
    d, c = columns.shape
    for _ in range(calls):
        for k in range(d):
            for i in range(c):
                work.columns[k, i] = columns[k, i]
        factored_impact(mass, lower, v, restitution, c, tolerance, d, True, work, v_plus, momentum)


@kernel
def repeat_impact(  # type: ignore[no-untyped-def]
    mass_matrix, lower, v, restitution, columns, work, v_plus, momentum, times
):
    """Factor M, copy the rows and resolve the impact, `times` times."""
    d, count = columns.shape
    for _ in range(times):
        cholesky(mass_matrix, lower)
        for k in range(d):
            for i in range(count):
                work.columns[k, i] = columns[k, i]
        factored_impact(mass_matrix, lower, v, restitution, count, rank_tolerance(lower), d, True, work, v_plus,
                        momentum)


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
