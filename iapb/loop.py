"""The loop of a simulation as one kernel, which does many steps or parts of one, and its record."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iapb.contact.kernels.motion import STATUS_TEXT
from iapb.contact.kernels.step import advance, contact_state
from iapb.haptics.rendering import NO_COUPLING, couple, move_device, read_device, render
from iapb.numerics.compiled import Entry, block, copy_into, kernel
from iapb.numerics.copying import line_copier
from iapb.numerics.linalg import load, store
from iapb.numerics.schema import Integers, Quantity, blank, quantities
from iapb.run import MADE_AFTERWARDS, ContactTable, ImpactTable, Run

DEVICE_NOT_FINITE = 1 + max(STATUS_TEXT)
FAILURES = STATUS_TEXT | {
    DEVICE_NOT_FINITE: "the device's motion left the range of numbers: the step is too long "
    "for this coupling and delay"
}

# parts of a step
COUPLE = 1
ADVANCE = 2
RENDER = 4
MOVE = 8
WRITE = 16
WHOLE = COUPLE | ADVANCE | RENDER | MOVE | WRITE

# Arrays that the loop writes; poses, energies and digests of M are computed from them.
STATES = tuple(each for each in quantities(Run, "time") if each.name != "pose")
STEPS = (
    *quantities(Run, "step"),
    Quantity("contact_count", ("step",), np.int64, "1", "contacts of the step"),
)
CONTACTS = quantities(ContactTable, "contact")
IMPACTS = tuple(each for each in quantities(ImpactTable) if each.name not in MADE_AFTERWARDS)
LINES = {"steps": STATES + STEPS, "contacts": CONTACTS, "impacts": IMPACTS}

Coordinates = tuple[int, int, int, int]


class Record(NamedTuple):
    """Memory for up to n steps of at most c contacts and m impacts, with the names of `iapb.run`."""

    used: Integers  # (3,) steps, contacts and impacts written so far
    steps: Any  # n lines, with the states at the *end* of each step
    contacts: Any  # n c lines
    # n m lines, one per island and impact; the time is that since the start of the step
    impacts: Any


def make_record(steps: int, coordinates: Coordinates, contacts: int, impacts: int) -> Any:
    """Allocate a record of steps with at most so many contacts and impacts; `coordinates` = (nq, d,
    nq_t, d_t)."""
    lengths = {
        "time": steps,
        "step": steps,
        "contact": steps * contacts,
        "impact": steps * impacts,
        "axis": 3,
    }
    lengths |= zip(
        ("coordinate", "velocity", "device_coordinate", "device_velocity"), coordinates, strict=True
    )
    return block(
        Record(
            np.zeros(3, np.int64),
            **{name: blank(listed, lengths, np.empty) for name, listed in LINES.items()},
        )
    )


@kernel
def write_step(record, k, step, state, port):
    """Copy step number `step` into line k of the record."""
    line = record.steps
    for i in range(len(state.q)):
        line.q[k, i] = state.q[i]
    # one loop: eight short ones would cost more than what they copy
    for i in range(len(state.v)):
        line.v[k, i] = state.v[i]
        line.hand_force[k, i] = port.hand_force[i]
        line.coupling_force[k, i] = port.coupling_force[i]
        line.penalty_force[k, i] = state.penalty_force[i]
        line.friction_force[k, i] = state.friction_force[i]
        line.impulse[k, i] = state.impulse[i]
        line.environment_force[k, i] = port.environment_force[i]
    for i in range(len(port.device_q)):
        line.device_q[k, i] = port.device_q[i]
    for i in range(len(port.device_v)):
        line.device_v[k, i] = port.device_v[i]
        line.device_force[k, i] = port.device_force[i]
    line.state[k] = contact_state(state, port.tool_tree)
    line.contact_count[k] = state.contact_count[0]
    record.used[0] = k + 1
    _write_tables(record, step, state)


_copy_contact = line_copier(each for each in CONTACTS if each.name != "impulse")
_copy_impact = line_copier(each for each in IMPACTS if each.name != "step")


@kernel
def _write_tables(record, step, state):
    line = record.contacts
    contacts = state.contacts
    m = record.used[1]
    for i in range(state.contact_count[0]):
        _copy_contact(line, m, contacts, i)
        line.impulse[m] = state.contact_impulse[i]
        if contacts.moved[i]:
            store(line.point, m, load(contacts.struck_point, i))
            store(line.normal, m, load(contacts.struck_normal, i))
        m += 1
    record.used[1] = m
    m = record.used[2]
    for i in range(state.impacts.logged[0]):
        _copy_impact(record.impacts, m, state.impacts, i)
        record.impacts.step[m] = step
        m += 1
    record.used[2] = m


@kernel
def steps_of_loop(world, state, port, record, parts, first, steps):
    """Do `steps` steps of an engine law, or parts of them; return the number of steps done and the
    status."""
    line = record.used[0]
    for k in range(steps):
        if parts == WHOLE and len(port.planned) > 0:
            copy_into(port.wrench, port.planned[k])
        if parts & COUPLE:
            couple(world, state, port)
        if parts & ADVANCE:
            status = advance(world, state, port.applied)
            if status:
                return k, status
        if parts & RENDER:
            render(world, state, port)
        if parts & MOVE and port.coupling != NO_COUPLING and not move_device(world, state, port):
            return k, DEVICE_NOT_FINITE
        if parts & WRITE:
            write_step(record, line + k, first + k, state, port)
    return steps, 0


@kernel
def steps_with_hand(world, state, port, q, v, forces):
    """Do one step of an engine law for each reading (n, d) of a device that the hand moves; write the
    actuator force of each step."""
    for k in range(len(q)):
        read_device(world, state, port, q[k], v[k])
        couple(world, state, port)
        status = advance(world, state, port.applied)
        if status:
            return k, status
        render(world, state, port)
        copy_into(forces[k], port.device_force)
    return len(q), 0


run_steps = Entry(steps_of_loop)
follow_hand = Entry(steps_with_hand)
