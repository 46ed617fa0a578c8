"""Recording of a simulation, chunk by chunk: what the loop writes and how it becomes a Run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from iapb.compiled import block, copy_into, kernel
from iapb.contact.kernels.step import contact_state
from iapb.mechanics.kernels.vectors import load, store
from iapb.run import ContactTable, ImpactTable

_CONTACT_ROWS_PER_CHUNK = 200_000  # bounds the memory of a chunk in scenes with many contacts (about 30 MB)
_STEPS_PER_CHUNK = 512  # one second of the paper's loop: progress and Ctrl-C answer at least that often


class Record(NamedTuple):
    """Arrays of one chunk of n steps; states are those at the *end* of each step."""

    q: np.ndarray  # (n, nq)
    v: np.ndarray  # (n, d)
    device_q: np.ndarray  # (n, nq_t)
    device_v: np.ndarray  # (n, d_t)
    hand_force: np.ndarray  # (n, d)
    coupling_force: np.ndarray  # (n, d)
    penalty_force: np.ndarray  # (n, d)
    friction_force: np.ndarray  # (n, d)
    impulse: np.ndarray  # (n, d)
    environment_force: np.ndarray  # (n, d)
    device_force: np.ndarray  # (n, d_t)
    state: np.ndarray  # (n,) int8
    contact_count: np.ndarray  # (n,) int64
    body_a: np.ndarray  # (m,) contacts, m the capacity of the chunk
    body_b: np.ndarray
    point: np.ndarray  # (m, 3)
    normal: np.ndarray  # (m, 3)
    gap: np.ndarray
    normal_velocity: np.ndarray
    normal_force: np.ndarray
    contact_friction: np.ndarray  # (m, 3)
    contact_impulse: np.ndarray
    is_new: np.ndarray
    impact_step: np.ndarray  # (n t,) impacts, one line per island and step
    impact_group: np.ndarray
    impact_rows: np.ndarray
    impact_rank: np.ndarray
    impact_scale: np.ndarray
    impact_clamp: np.ndarray
    impact_energy: np.ndarray
    impact_friction_share: np.ndarray
    impact_approaching: np.ndarray
    impact_solved: np.ndarray
    impact_v_minus: np.ndarray  # (n t, d)
    impact_v_plus: np.ndarray
    impact_impulse: np.ndarray
    used: np.ndarray  # (2,) int64: contacts and impacts written so far


def chunk_steps(contacts: int, remaining: int) -> int:
    """Number of steps of the next chunk."""
    return max(1, min(remaining, _STEPS_PER_CHUNK, _CONTACT_ROWS_PER_CHUNK // max(1, contacts)))


def make_record(steps: int, coordinates: tuple[int, int, int, int], contacts: int, trees: int) -> Record:
    """Allocate one chunk; `coordinates` = (nq, d, nq_t, d_t)."""
    nq, d, tool_nq, tool_d = coordinates
    m, k = steps * contacts, steps * trees
    floats = {
        "q": (steps, nq), "v": (steps, d), "device_q": (steps, tool_nq), "device_v": (steps, tool_d),
        **dict.fromkeys(("hand_force", "coupling_force", "penalty_force", "friction_force", "impulse",
                         "environment_force"), (steps, d)),
        "device_force": (steps, tool_d),
        **dict.fromkeys(("point", "normal", "contact_friction"), (m, 3)),
        **dict.fromkeys(("gap", "normal_velocity", "normal_force", "contact_impulse"), (m,)),
        **dict.fromkeys(("impact_scale", "impact_clamp", "impact_energy", "impact_friction_share"), (k,)),
        **dict.fromkeys(("impact_v_minus", "impact_v_plus", "impact_impulse"), (k, d)),
    }
    integers = {
        **dict.fromkeys(("body_a", "body_b"), (m,)), "contact_count": (steps,), "used": (2,),
        **dict.fromkeys(("impact_step", "impact_group", "impact_rows", "impact_rank", "impact_approaching"), (k,)),
    }
    arrays: dict[str, Any] = {name: np.zeros(shape) for name, shape in floats.items()}
    arrays |= {name: np.zeros(shape, np.int64) for name, shape in integers.items()}
    arrays |= {"state": np.zeros(steps, np.int8), "is_new": np.zeros(m, np.bool_),
               "impact_solved": np.zeros(k, np.bool_)}
    return block(Record(**arrays))


@kernel
def write_step(record, k, step, state, port):
    """Copy step number `step` into line k of the chunk."""
    for i in range(state.q.shape[0]):
        record.q[k, i] = state.q[i]
    for i in range(state.v.shape[0]):  # one loop: eight short ones would cost more than what they copy
        record.v[k, i] = state.v[i]
        record.hand_force[k, i] = port.hand_force[i]
        record.coupling_force[k, i] = port.coupling_force[i]
        record.penalty_force[k, i] = state.penalty_force[i]
        record.friction_force[k, i] = state.friction_force[i]
        record.impulse[k, i] = state.impulse[i]
        record.environment_force[k, i] = port.environment_force[i]
    for i in range(port.device_q.shape[0]):
        record.device_q[k, i] = port.device_q[i]
    for i in range(port.device_v.shape[0]):
        record.device_v[k, i] = port.device_v[i]
        record.device_force[k, i] = port.device_force[i]
    record.state[k] = contact_state(state, port.tool_tree)
    _write_contacts(record, k, state)
    if state.impacts.logged[0] > 0:
        _write_impacts(record, step, state)


@kernel
def _write_contacts(record, k, state):
    contacts, count, m = state.contacts, state.contact_count[0], record.used[0]
    record.contact_count[k] = count
    record.used[0] = m + count
    for i in range(count):
        record.body_a[m], record.body_b[m] = contacts.body_a[i], contacts.body_b[i]
        store(record.point, m, load(contacts.point, i))
        store(record.normal, m, load(contacts.normal, i))
        store(record.contact_friction, m, load(contacts.friction_force, i))
        record.gap[m], record.normal_velocity[m] = contacts.gap[i], contacts.normal_velocity[i]
        record.normal_force[m] = contacts.normal_force[i]
        record.contact_impulse[m], record.is_new[m] = state.contact_impulse[i], contacts.is_new[i]
        m += 1


@kernel
def _write_impacts(record, step, state):
    log = state.impacts
    for i in range(log.logged[0]):
        m = record.used[1]
        record.impact_step[m], record.impact_group[m] = step, log.group[i]
        record.impact_rows[m], record.impact_rank[m] = log.rows[i], log.rank[i]
        record.impact_scale[m], record.impact_clamp[m] = log.scale[i], log.clamp[i]
        record.impact_energy[m], record.impact_friction_share[m] = log.energy_lost[i], log.friction_share[i]
        record.impact_approaching[m], record.impact_solved[m] = log.approaching[i], log.solved[i]
        copy_into(record.impact_v_minus[m], log.v_minus[i])
        copy_into(record.impact_v_plus[m], log.v_plus[i])
        copy_into(record.impact_impulse[m], log.impulse[i])
        record.used[1] = m + 1


def joined(records: Sequence[Record], steps: Sequence[int], name: str, used: int | None = None) -> np.ndarray:
    """One array over all chunks; `used` picks the ragged count (0 contacts, 1 impacts), None the steps."""
    sizes = steps if used is None else [int(record.used[used]) for record in records]
    return np.concatenate([getattr(record, name)[:size] for record, size in zip(records, sizes, strict=True)])


def contact_table(records: Sequence[Record], steps: Sequence[int]) -> ContactTable:
    """The ragged table of all contacts."""
    counts = joined(records, steps, "contact_count")
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    names = {"impulse": "contact_impulse", "friction_force": "contact_friction"}
    fields = ("body_a", "body_b", "point", "normal", "gap", "normal_velocity", "normal_force", "friction_force",
              "impulse", "is_new")
    columns = {field: joined(records, steps, names.get(field, field), used=0) for field in fields}
    return ContactTable(offsets=offsets, **columns)


def impact_table(records: Sequence[Record], steps: Sequence[int]) -> ImpactTable:
    """The table of all impacts."""
    names = {"step": "impact_step", "group": "impact_group", "rows": "impact_rows", "rank": "impact_rank",
             "scale": "impact_scale", "clamp": "impact_clamp", "energy_lost": "impact_energy",
             "friction_share": "impact_friction_share", "approaching": "impact_approaching", "solved": "impact_solved",
             "v_minus": "impact_v_minus", "v_plus": "impact_v_plus", "impulse": "impact_impulse"}
    return ImpactTable(**{field: joined(records, steps, name, used=1) for field, name in names.items()})
