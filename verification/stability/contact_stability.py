"""Finding on the stability of sampled contact with penalties and impulses (C20, C21), and on its rate-hardness."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from iapb.run import Run
from verification.finding import (
    MIXED,
    REFUTED,
    REPRODUCED,
    Failure,
    Finding,
    Part,
    Table,
    attempt,
    finding_of,
    titled,
)
from verification.stability.device_port import coordinated, coupled, device_port_leaks
from verification.stability.maps import (
    BOUNCES_ON,
    GROWS,
    PAPER_DAMPING,
    SETTLES,
    StabilityMap,
    grid,
    stability_maps,
)
from verification.stability.peg import peg, peg_contacts, pulses, waveforms

QUESTION = (
    "A virtual wall in a sampled loop can feed energy to the hand. First, a constant force pushes a mass of 2 kg "
    "against walls over a grid of stiffness and damping; the loop samples at 512 Hz or 1 kHz, and the motion between "
    "samples is exact. Then the peg of Figure 4 runs in the engine's own loop. The dashed line is Colgate's condition "
    "for passivity, b >= KT/2 + |B|, which is sufficient for any hand. A wall is stable if the mass comes to rest."
)
MARKS = {SETTLES: "+", BOUNCES_ON: "o", GROWS: "x"}

Maps = Sequence[StabilityMap]


def contact_stability(run: Callable[..., Run], depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Compute the stability maps of the sampled wall, and run the peg under the same laws.

    Parameters
    ----------
    run : (scene, world, keep, partial) -> Run; no run is stored, and incomplete runs are used
    """
    failures: list[Failure] = []
    maps = stability_maps(depth, failures)
    pegs = peg_contacts(run, depth, progress, failures)
    shapes = waveforms(run, failures)
    ports = device_port_leaks(depth, failures)
    tables = {
        "maps": maps_table(maps), "dampings": titled(("damping [N s/m]",), [(float(B),) for B in grid(depth)[1]]),
        "hardness": hardness(maps), "peg": pegs, "waveforms": shapes, "hand port": ports,
    }  # fmt: skip
    said = {
        "held": partial(held, maps), "beyond": partial(beyond, maps), "undamped": partial(undamped, maps),
        "hard": partial(hard, maps), "peg": partial(peg, pegs), "pulses": partial(pulses, shapes),
        "coupled": partial(coupled, ports), "coordinated": partial(coordinated, ports),
    }  # fmt: skip
    tried = {name: attempt(f"sentence on {name}", judge, failures) for name, judge in said.items()}
    answer = tried["held"].sentence if tried["held"] else ""
    parts = [part for part in tried.values() if part]
    return finding_of("stability", "Stability of contact", QUESTION, answer, parts, tables, failures)


def _pairs(maps: Maps) -> list[tuple[StabilityMap, StabilityMap]]:
    return list(zip(maps[::2], maps[1::2], strict=True))


def maps_table(maps: Maps) -> Table:
    """Return a table with one row per loop and stiffness, and one mark per damping for its outcome."""
    rows = []
    for penalty, impulses in _pairs(maps):
        size = len(penalty.stiffness)
        bound = np.maximum(penalty.loop.passive_damping(penalty.stiffness), 0.0)
        for i, K in enumerate(penalty.stiffness):
            marks = ["".join(MARKS[outcome] for outcome in one.outcomes[i::size]) for one in (penalty, impulses)]
            rows.append((*_loop(penalty), float(K), float(bound[i]), *marks))
    return titled(
        (*LOOP, "stiffness [N/m]", "passive up to [N s/m]", "penalties", "impulses"), rows, 3,
        "One mark per damping, from small to large: + the mass settles, o it keeps bouncing, x its motion "
        "grows.")  # fmt: skip


LOOP = ("rate [Hz]", "sensors", "device damping [N s/m]")


def _loop(one: StabilityMap) -> tuple[float, str, float]:
    return one.loop.rate, "late" if one.loop.delay else "ideal", one.loop.device_damping


def held(maps: Maps) -> Part:
    """Return the part on the number of walls that are stable under each law."""
    theirs, ours = (np.array([pair[law].contact.settled for pair in _pairs(maps)]) for law in (0, 1))
    more, lost = ours.sum(axis=1) / theirs.sum(axis=1), int((theirs & ~ours).sum())
    return Part(
        f"Of {theirs.size} walls, {theirs.sum()} are stable with penalties and {ours.sum()} with impulses: "
        f"{more.min():.2f} to {more.max():.2f} times as many, depending on the loop. {lost} walls are stable only "
        "with penalties.",
        REFUTED if more.min() < 1.0 else MIXED if lost else REPRODUCED,
        miss=f"{lost} of {theirs.size} walls are stable only without impulses" if lost else "")  # fmt: skip


def beyond(maps: Maps) -> Part:
    """Return the part on the condition b >= KT/2 + |B|, which applies to ideal sensors and penalties."""
    chosen = [one for one in maps if one.passive.any() and one.law == "penalty" and not one.loop.delay]
    passive = np.stack([one.passive for one in chosen])
    grown, settled = (np.array([getattr(one.contact, name) for one in chosen]) for name in ("grown", "settled"))
    gains = int((grown & passive).sum())
    return Part(
        f"Where b >= KT/2 + |B| holds, no wall may accelerate the hand: {gains} of {passive.sum()} do. With this hand "
        f"{(settled & ~passive).sum()} walls outside the condition settle as well, because the condition covers every "
        "hand.",
        REFUTED if gains else REPRODUCED)  # fmt: skip


def undamped(maps: Maps) -> Part:
    """Return the part on the stable walls of a device without damping."""
    bare = [one for one in maps if one.loop.device_damping == 0.0 and not one.loop.delay and one.law == "penalty"]
    shares = ", ".join(f"{100 * one.settled_share:.0f} % at {one.loop.rate:.0f} Hz" for one in bare)
    return Part(
        "The paper's device has no damping, b = 0. By the condition no wall is then passive for every hand. With this "
        f"hand, a constant force, penalties are still stable on {shares} of these walls.", MIXED)  # fmt: skip


def hard(maps: Maps) -> Part:
    """Return the part on rate-hardness and penetration of impulses, relative to penalties."""
    pairs = [(theirs.contact, ours.contact, rows) for theirs, ours, rows in _at_paper(maps)]
    harder, deeper = (
        [float(np.median(getattr(ours, name)[rows] / getattr(theirs, name)[rows])) for theirs, ours, rows in pairs]
        for name in ("rate_hardness", "penetration")
    )  # fmt: skip
    return Part(
        f"At the paper's wall damping of {PAPER_DAMPING:g} N s/m the rate-hardness with impulses is {min(harder):.3g} "
        f"to {max(harder):.3g} times that with penalties (median over stiffnesses), and the penetration "
        f"{min(deeper):.2f} to "
        f"{max(deeper):.2f} times.", REPRODUCED if min(harder) > 1.0 and max(deeper) <= 1.0 else MIXED,
    )  # fmt: skip


def _at_paper(maps: Maps) -> list[tuple[StabilityMap, StabilityMap, slice]]:
    """Return both maps of each loop, and the slice of the paper's damping in them."""
    found = []
    for theirs, ours in _pairs(maps):
        size, row = len(theirs.stiffness), int(np.flatnonzero(theirs.damping == PAPER_DAMPING)[0])
        found.append((theirs, ours, slice(row * size, (row + 1) * size)))
    return found


def hardness(maps: Maps) -> Table:
    """Return a table with one row per loop, law and stiffness at the paper's damping."""
    rows = []
    for theirs, ours, at in _at_paper(maps):
        for one in (theirs, ours):
            c = one.contact
            for K, *values in zip(one.stiffness, c.rate_hardness[at], c.settling_time[at], c.penetration[at],
                                  c.bounces[at], c.peak_force[at], strict=True):  # fmt: skip
                hard_at_first, settling, depth, bounces, peak = (float(value) for value in values)
                rows.append((*_loop(one), one.law, float(K), hard_at_first,
                             settling if math.isfinite(settling) else None, 1e3 * depth, int(bounces), peak))
    return titled((*LOOP, "law", "stiffness [N/m]", "rate-hardness [N/m]", "settles after [s]", "penetration [mm]",
                   "bounces", "peak force [N]"), rows, 3,
                  "Wall damping 50 N s/m, as in the paper. Rate-hardness: the rise of the force per second over the "
                  "first step of contact, divided by the approach speed (Lawrence and others, 2000).")  # fmt: skip
