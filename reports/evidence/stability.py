"""Topic: how stable sampled contact is, with penalties and with impulses (C20, C21), and how hard it feels."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from reports.evidence.runs import shipped_scene
from reports.runner import Runner
from verification.finding import (
    LIMITED,
    NOT_TESTABLE,
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

LEAD = (
    "A wall in a sampled loop can feed the hand. A mass of 2 kg is pushed against walls of every stiffness and "
    "damping, read and answered at 512 Hz or 1 kHz, its motion between the samples exact; then the peg of Figure 4 in "
    "the engine's own loop. The line is Colgate's condition for passivity, b >= KT/2 + |B|: sufficient for any hand."
)
MARKS = {"settles": "+", "bounces on": "o", "grows": "x"}


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Maps of the sampled wall, and the peg under the same laws."""
    from verification.stability.device_port import device_port_leaks
    from verification.stability.maps import grid, stability_maps
    from verification.stability.peg import peg_contacts
    from verification.stability.waveforms import compare_waveforms

    failures: list[Failure] = []
    maps = stability_maps(depth, failures=failures)
    pegs = peg_contacts(shipped_scene("peg_corner"),
                        lambda scene, world: runner(scene, world, keep=False, partial=True), depth, progress, failures)
    pulses = compare_waveforms(shipped_scene("peg_corner"), lambda scene: runner(scene, "IAPB", keep=False), failures)
    ports = device_port_leaks(depth, failures=failures)
    tables = {
        "maps": _maps(maps), "dampings": titled(("damping [N s/m]",), tuple((float(B),) for B in grid(depth)[1])),
        "hardness": _hardness(maps), "peg": _pegs(pegs),
        "waveforms": _waveforms(pulses), "hand port": _ports(ports),
    }  # fmt: skip
    judges = ((_held, maps), (_beyond, maps), (_undamped, maps), (_hard, maps), (_peg, pegs), (_pulses, pulses),
              (_coupled, ports), (_coordinated, ports))  # fmt: skip
    tried = [attempt(f"sentence on {judge.__name__.strip('_')}", partial(judge, records), failures)
             for judge, records in judges]  # fmt: skip
    findings = tuple(finding for finding in tried if finding is not None)
    verdict = findings[0].sentence if tried[0] is not None else ""
    return finding_of("stability", "Stability of contact", LEAD, verdict, findings, tables, failures)


def _pairs(maps: Sequence[Any]) -> list[tuple[Any, Any]]:
    return list(zip(maps[::2], maps[1::2], strict=True))


def _maps(maps: Sequence[Any]) -> Table:
    """A row per loop and stiffness; outcomes as one mark for each damping."""
    rows = []
    for penalty, impulses in _pairs(maps):
        loop, size = penalty.loop, len(penalty.stiffness)
        bound = loop.passive_damping(penalty.stiffness)
        for i, K in enumerate(penalty.stiffness):
            marks = ["".join(MARKS[outcome] for outcome in one.outcomes[i::size]) for one in (penalty, impulses)]
            rows.append((loop.rate, _sensors(loop), loop.device_damping, float(K), max(float(bound[i]), 0.0), *marks))
    return titled(
        ("rate [Hz]", "sensors", "device damping [N s/m]", "stiffness [N/m]", "passive up to [N s/m]", "penalties",
         "impulses"), tuple(rows), 3,
        "A mark for each damping, small to large: + settles, o bounces on, x grows.")  # fmt: skip


def _sensors(loop: Any) -> str:
    return "late" if loop.delay else "ideal"


def _held(maps: Sequence[Any]) -> Part:
    pairs = _pairs(maps)
    theirs, ours = (np.array([pair[law].contact.settled for pair in pairs]) for law in (0, 1))
    more = ours.sum(axis=1) / theirs.sum(axis=1)
    lost = int((theirs & ~ours).sum())
    outcome = REFUTED if more.min() < 1.0 else LIMITED if lost else REPRODUCED
    return Part(
        f"Of {theirs.size} walls, penalties hold {theirs.sum()} and impulses {ours.sum()}, {more.min():.2f} to "
        f"{more.max():.2f} times as many per loop; {lost} walls only penalties hold.", outcome)  # fmt: skip


def _beyond(maps: Sequence[Any]) -> Part:
    """The condition speaks of ideal sensors and penalties."""
    chosen = [one for one in maps if one.passive.any() and one.law == "penalty" and not one.loop.delay]
    passive = np.stack([one.passive for one in chosen])
    grown, settled = (np.array([getattr(one.contact, name) for one in chosen]) for name in ("grown", "settled"))
    gains = int((grown & passive).sum())
    return Part(
        f"Within b >= KT/2 + |B| no wall may make the hand faster: {gains} of {passive.sum()} do. Under this hand "
        f"{(settled & ~passive).sum()} walls beyond it settle too: it is a condition for every hand, not for this one.",
        REFUTED if gains else REPRODUCED)  # fmt: skip


def _undamped(maps: Sequence[Any]) -> Part:
    bare = [one for one in maps if one.loop.device_damping == 0.0 and not one.loop.delay and one.law == "penalty"]
    shares = ", ".join(f"{100 * one.settled_share:.0f} % at {one.loop.rate:.0f} Hz" for one in bare)
    return Part(
        "The paper's device has no damping, b = 0: by the condition no wall at all is passive for every hand. That "
        f"penalties still hold {shares} of these walls rests on this hand, a constant push.", LIMITED)  # fmt: skip


def _hard(maps: Sequence[Any]) -> Part:
    pairs = [(theirs.contact, ours.contact, rows) for theirs, ours, rows in _at_paper(maps)]
    harder, deeper = (
        [float(np.median(getattr(ours, name)[rows] / getattr(theirs, name)[rows])) for theirs, ours, rows in pairs]
        for name in ("rate_hardness", "penetration")
    )  # fmt: skip
    return Part(
        f"At the paper's damping of 50 N s/m an impulse feels {min(harder):.3g} to {max(harder):.3g} times as hard at "
        f"first (rate-hardness, median over stiffnesses) and lets the hand {min(deeper):.2f} to {max(deeper):.2f} "
        "times as deep.", REPRODUCED if min(harder) > 1.0 and max(deeper) <= 1.0 else LIMITED)  # fmt: skip


def _at_paper(maps: Sequence[Any]) -> list[tuple[Any, Any, slice]]:
    from verification.stability.maps import PAPER_DAMPING

    found = []
    for theirs, ours in _pairs(maps):
        size, row = len(theirs.stiffness), int(np.flatnonzero(theirs.damping == PAPER_DAMPING)[0])
        found.append((theirs, ours, slice(row * size, (row + 1) * size)))
    return found


def _hardness(maps: Sequence[Any]) -> Table:
    rows = []
    for theirs, ours, at in _at_paper(maps):
        for one in (theirs, ours):
            c, loop = one.contact, one.loop
            for K, *values in zip(one.stiffness, c.rate_hardness[at], c.settling_time[at], c.penetration[at],
                                  c.bounces[at], c.peak_force[at], strict=True):  # fmt: skip
                hardness, settling, depth, bounces, peak = (float(value) for value in values)
                rows.append((loop.rate, _sensors(loop), loop.device_damping, one.law, float(K), hardness,
                             settling if math.isfinite(settling) else None, 1e3 * depth, int(bounces), peak))
    return titled(("rate [Hz]", "sensors", "device damping [N s/m]", "law", "stiffness [N/m]", "rate-hardness [N/m]",
                    "settles after [s]", "penetration [mm]", "bounces", "peak force [N]"), tuple(rows), 3,
                   "At the paper's damping, 50 N s/m. Rate-hardness: the first rise of the force over one step, per "
                   "speed on touching (Lawrence and others, 2000).")  # fmt: skip


def _pegs(pegs: Sequence[Any]) -> Table:
    rows = tuple((p.device, p.stiffness, p.damping, p.world, p.settling_time, p.bounces, 1e3 * p.penetration, p.note)
                 for p in pegs)
    return titled(("device", "stiffness [N/m]", "damping [N s/m]", "world", "settles after [s]", "bounces",
                    "penetration [mm]", "stopped"), rows, 3, "A dash: it never came to rest.")


def _peg(pegs: Sequence[Any]) -> Part:
    pairs = list(zip(pegs[::2], pegs[1::2], strict=True))
    sooner = [(a, b) for a, b in pairs if b.settling_time is not None
              and (a.settling_time is None or b.settling_time <= a.settling_time)]
    decided = [(a, b) for a, b in pairs if (a.settling_time, b.settling_time) != (None, None)]
    fewer = sum(b.bounces <= a.bounces for a, b in pairs)
    share = len(sooner) / max(1, len(decided))
    outcome = NOT_TESTABLE if not decided else REPRODUCED if share == 1.0 else LIMITED if share >= 0.5 else REFUTED
    return Part(
        f"The peg in the corner comes to rest no later with impulses in {len(sooner)} of {len(decided)} trials of "
        f"device and wall where either does, and bounces no more often in {fewer} of {len(pairs)}.",
        outcome)


def _waveforms(pulses: Sequence[Any]) -> Table:
    rows = tuple((p.waveform, p.rate_hardness, p.peak_force, p.settling_time, p.bounces, 1e3 * p.penetration, p.unpaid,
                  1e3 * p.given, 1e3 * p.lost) for p in pulses)  # fmt: skip
    return titled(
        ("waveform", "rate-hardness [N/m]", "peak force [N]", "settles after [s]", "bounces", "penetration [mm]",
         "momentum not given", "given to the hand [mJ]", "lost in collisions [mJ]"), rows, 3,
        "The peg in the corner at 1 kHz, the impulse given by its device in each way. Negative energy: the pulses took "
        "it from the hand. Momentum not given is still on its way at the end.")  # fmt: skip


def _pulses(pulses: Sequence[Any]) -> Part:
    most, unpaid = max(p.given - p.lost for p in pulses), max(p.unpaid for p in pulses)
    forces = {p.waveform: p.peak_force for p in pulses}
    brake = ("" if not {"step", "brake"} <= set(forces) else
             f"; a brake asks for {forces['brake']:.3g} N at most where one step asks for {forces['step']:.3g} N")
    return Part(
        f"Every waveform gives the hand the computed momentum (all but {unpaid:.0e}) and no more energy than the "
        f"collisions took{brake}.", REPRODUCED if most <= 0.0 else REFUTED)  # fmt: skip


def _ports(ports: Sequence[Any]) -> Table:
    rows = tuple((p.loop.world, p.loop.stiffness, p.loop.damping, p.sensors, p.motion, p.loop.bound, p.needed, p.ratio,
                  1e3 * p.leak, p.leak / p.turned_over if p.leak else 0.0) for p in ports)  # fmt: skip
    return titled(
        ("world", "stiffness [N/m]", "damping [N s/m]", "sensors", "the hand", "KT/2 + |B| [N s/m]",
         "damping needed [N s/m]", "needed / bound", "leak at the bound [mJ]", "of what was turned over"), rows, 4,
        "Whole device loops at 512 Hz, the hand moving 0.5 mm to and fro, worst over several speeds; stiffness and "
        "damping of the coupler in CBuc, else of the wall, with the coordination of Table I.")  # fmt: skip


def _coupled(ports: Sequence[Any]) -> Part:
    from verification.stability.device_loop import COUPLER_WORLD

    coupled = [p for p in ports if p.loop.world == COUPLER_WORLD]
    pressing = [p for p in coupled if p.motion == "presses" and p.sensors == "ideal"]
    crossing, late = ([p.ratio for p in coupled if p.motion == motion and (p.sensors == "ideal") == ideal]
                      for motion, ideal in (("crosses", True), ("presses", False)))  # fmt: skip
    most = max(p.ratio for p in pressing)
    return Part(
        "A device coupled to a tool on a rigid wall, the hand pressing and the sensors ideal, leaks nothing from "
        f"b = KT/2 + |B| of the coupler on: it needs {most:.4f} of that. Late or coarse sensors need up to "
        f"{max(late):.3g} of it, and a hand that goes in and out of contact {max(crossing):.3g}: a coupler that "
        "switches on stretched brings energy of its own.",
        LIMITED if most <= 1.0 + 1e-9 else REFUTED)  # fmt: skip


def _coordinated(ports: Sequence[Any]) -> Part:
    from verification.stability.device_loop import COORDINATION, COUPLER_WORLD

    four = [p for p in ports if p.loop.world != COUPLER_WORLD]
    wall, whole = (max(p.needed / bound(p.loop) for p in four) for bound in
                   (lambda loop: loop.bound, lambda loop: loop.bound_with_coordination))  # fmt: skip
    return Part(
        f"With the four-channel controller the wall's own KT/2 + |B| is not enough: up to {wall:.3g} of it is needed, "
        f"{min(p.needed for p in four):.3g} to {max(p.needed for p in four):.3g} N s/m, for the coordination's damping "
        f"of {COORDINATION[1]:g} N s/m is felt in the hand as well. The gains of both added, up to {whole:.3g} of the "
        "bound is needed: no bound here, for the tool moves. The paper's device has no damping.", LIMITED)
