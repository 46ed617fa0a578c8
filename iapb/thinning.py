"""Thin the record of a long run: keep every N-th step, each step with an impact, and the state at
the end.

Energies, distrust and poses are computed from all steps, piece by piece, before a piece is thinned.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.numerics.schema import Integers, quantities
from iapb.run import ContactTable, ImpactTable, Run

_STATES = ("time", *(each.name for each in quantities(Run, "time")))
_STEPS = tuple(each.name for each in quantities(Run, "step"))
_CONTACTS = tuple(each.name for each in quantities(ContactTable, "contact"))
_IMPACTS = tuple(each.name for each in quantities(ImpactTable))


class Thinned:
    """The kept steps of consecutive pieces of a run.

    Kept step i begins at ``time[i]`` in the state ``q[i]``, ``v[i]``. An impact counts the kept
    steps, so ``q[step]`` is the configuration in which it happened. A sum of energy in entry i
    reaches up to ``time[i + 1]``.

    Parameters
    ----------
    every : N; step k is kept if N divides k, or if it has an impact
    """

    def __init__(self, every: int) -> None:
        self.every = every
        self.rows = 0  # number of steps kept so far
        self.distrust: tuple[str, ...] = ()  # of the first piece that has one
        self._columns: dict[str, list[NDArray[Any]]] = {}

    def add(self, piece: Run, first: int, before: Mapping[str, float], last: bool) -> None:
        """Keep some steps of a piece.

        Parameters
        ----------
        piece : consecutive steps of a run, from step `first` on; its impacts have the numbers of
            the run's steps
        before : sums of energy at its start (see `iapb.mechanics.energy.last_of`)
        last : whether the run ends with this piece, so that its last state is kept
        """
        struck = piece.impacts.step - first
        steps = np.union1d(np.arange(-first % self.every, piece.steps, self.every), struck)
        for name, values in _kept(piece, steps, before, last):
            self._columns.setdefault(name, []).append(values)
        impact_steps = self.rows + np.searchsorted(steps, struck)
        self._columns.setdefault("impacts/step", []).append(impact_steps)
        self.rows += len(steps)
        self.distrust = self.distrust or piece.distrust

    def run(self, piece: Run) -> Run:
        """Return the thinned run; `piece` is the last one, with all that is no array."""
        found = {name: np.concatenate(pieces) for name, pieces in self._columns.items()}
        offsets = np.append(0, np.cumsum(found["contacts/count"]))
        arrays: dict[str, Any] = {name: found[name] for name in (*_STATES, *_STEPS)}
        contacts = {name: found[f"contacts/{name}"] for name in _CONTACTS}
        impacts = {name: found[f"impacts/{name}"] for name in _IMPACTS}
        energy = {
            name: found[f"energy/{name}"][0 if len(values) > piece.steps else 1 :]
            for name, values in piece.energy.items()
        }
        return replace(
            piece,
            contacts=ContactTable(offsets, **contacts),
            impacts=ImpactTable(**impacts),
            energy=energy,
            every=self.every,
            distrust=self.distrust,
            **arrays,
        )


def _kept(
    piece: Run, steps: Integers, before: Mapping[str, float], last: bool
) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield name and kept values of each array of a piece; `steps` are those kept."""
    instants = np.append(steps, piece.steps) if last else steps
    for name in _STATES:
        yield name, getattr(piece, name)[instants]
    for name in _STEPS:
        yield name, getattr(piece, name)[steps]
    count = np.diff(piece.contacts.offsets)
    touching = np.repeat(np.isin(np.arange(piece.steps), steps), count)
    yield "contacts/count", count[steps]
    for name in _CONTACTS:
        yield f"contacts/{name}", getattr(piece.contacts, name)[touching]
    for name in _IMPACTS:
        if name != "step":
            yield f"impacts/{name}", getattr(piece.impacts, name)
    for name, values in piece.energy.items():
        at_instants = values
        if len(values) == piece.steps:
            at_instants = np.append(before.get(name, 0.0), values)
        yield f"energy/{name}", at_instants[instants]
