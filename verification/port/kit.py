"""`check_force(law, device)`: does a force law ever give energy to the hand, and what device would
it need?"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from reference import Floats
from verification.laws.bounds import Law, LawCount
from verification.laws.counterexample import import_line, name_of, residual_of, shrink, written
from verification.laws.kit import PATIENCE, Report, laws_named
from verification.port.device import BareDevice, Motion, Port, start_of, sums_of
from verification.port.laws import FORCE_LAWS, Terms, smaller_motions
from verification.port.search import (
    LONG,
    SLOWER,
    Found,
    Goal,
    NoForce,
    Search,
    edge_of,
    one_pass,
)

MOTIONS = 40  # for the laws other than energy
SLOW_EFFORT = 0.5  # of a whole search, in that for slow hands
STAGES = ("laws", "motions of the hand", "their improvement", "slow hands", "edge of the map")
EDGE = 9  # points of the edge that are searched
EDGE_EFFORT = 0.25  # of a whole search, for each of them
ENOUGH = 4  # motions that break the energy law, of which the shortest is shrunk
SHRINKING = 5.0  # [s] for a counterexample

_HEAD = (
    "{one.law}: {word} on a device of {one.device.damping:g} N s/m and {one.device.friction:g} N "
    "at {one.device.rate:g} Hz"
)
_ANY_HAND = """\
  any hand: it needs {enough} (with {one.device.friction:g} N of friction),
            or {least}{one.friction_needed:.4g} N of friction (with {one.device.damping:g} N s/m)"""
_SLOW_HANDS = "  hands slower than {one.fastest:g} Hz: {one.slow_damping:.4g} N s/m (measured)"
_NO_FORCE = "  it gave no force, so the search ended; x and v were {}, like the start"
_CALLS = "  {one.calls:,} calls in {one.seconds:.1f} s, seed {one.seed}"
_TEST = """\
import numpy as np
from verification.port import BareDevice, Motion, judge
{importing}


def test_{law}():
    device = {device!r}
    motion = Motion(
        start={start},
        lead={lead},
        cycle={cycle},
        repeats={repeats},
    )
    terms = dict(stored={terms.stored!r}, limit={terms.limit!r})
    residual = judge({law!r}, resolver, device, motion, **terms)
    assert residual.passed, residual"""


@dataclass
class ForceVerdict(LawCount):
    """Verdict on one law: `motion` is the first one that breaks it, `fault` what the law did then.
    A law that does not apply is printed with a dash.
    """

    statement: str = ""
    motion: Motion | None = None
    fault: str = ""

    @property
    def passed(self) -> bool:
        """Whether no motion broke the law."""
        return self.failures == 0

    def __str__(self) -> str:
        kept = "kept  " if self.checked else "-     "
        mark = kept if self.passed else "BROKEN"
        worst = f", worst {self.worst.words}" if self.worst and self.worst.value > 0.0 else ""
        fault = f"\n         {self.fault}" if self.fault else ""
        return f"  {mark} {self.law}: {self.statement}{worst}{fault}"


@dataclass(frozen=True, eq=False, repr=False)
class ForceReport(Report):
    """Report of `check_force`.

    Attributes
    ----------
    damping_needed : least b [N s/m] at the device's friction for any hand; infinite if no damping is
        enough, as a loop shows; NaN if the law gave no force in some motion.
    friction_needed : least f_c [N] at the device's damping; NaN likewise.
    slow_damping : least b for hands without frequencies above `fastest` [Hz], measured; None
        without `fastest`.
    edge : (n, 2) points (b, f_c) on the edge of the passive set, if asked for.
    found : the laws broken, each with a small motion, and what the law did if it gave no force.
    calls, seconds : calls of the law, and time.
    """

    law: str
    device: BareDevice
    terms: Terms
    seed: int
    verdicts: tuple[ForceVerdict, ...]
    damping_needed: float = 0.0
    friction_needed: float = 0.0
    fastest: float | None = None
    slow_damping: float | None = None
    edge: Floats = field(default_factory=lambda: np.empty((0, 2)))
    found: tuple[tuple[str, Motion, str], ...] = ()
    tested: Any = None
    calls: int = 0
    seconds: float = 0.0
    unfinished: str = ""

    @property
    def counterexample_test(self) -> str:
        """The first counterexample as source code of a test, or an empty text."""
        return self.test_of(*self.found[0][:2]) if self.found else ""

    def test_of(self, law: str, motion: Motion) -> str:
        """Return a counterexample as source code of a test."""
        return _TEST.format(
            importing=import_line(self.tested) or "\n# resolver = ...  the force law under test",
            law=law,
            device=self.device,
            start=written(motion.start),
            lead=written(motion.lead),
            cycle=written(motion.cycle),
            repeats=motion.repeats,
            terms=self.terms,
        )

    def _text(self) -> str:
        fails = self.broken_laws or self.damping_needed == np.inf
        word = "passed" if self.passed else "FAILED" if fails else "NOT FINISHED"
        lines = [_HEAD.format(one=self, word=word)]
        if "finite" in self.broken_laws:
            lines.append(_NO_FORCE.format(self._given))
        else:
            lines.append(_ANY_HAND.format(one=self, enough=self._enough, least=self._least))
            lines += [] if self.slow_damping is None else [_SLOW_HANDS.format(one=self)]
        if self.unfinished:
            lines.append(f"  {self.unfinished}")
        lines += [str(verdict) for verdict in self.verdicts]
        lines.append(_CALLS.format(one=self))
        for law, motion, fault in self.found:
            title = f"counterexample to {law}, {len(motion.positions)} samples:"
            lines += ["", title, *([f"  {fault}"] if fault else []), "", "as a test:", ""]
            lines.append(self.test_of(law, motion))
        return "\n".join(lines)

    @property
    def _least(self) -> str:
        return "at least " if self.unfinished else ""

    @property
    def _enough(self) -> str:
        if self.damping_needed == np.inf:
            return "more than any damping"
        return f"{self._least}{self.damping_needed:.4g} N s/m"

    @property
    def _given(self) -> str:
        """What the law got as x and v in the counterexample."""
        size = len(self.found[0][1].start)
        return "numbers" if size == 1 else f"arrays ({size},)"


def check_force(
    law: Any,
    device: BareDevice,
    *,
    start: ArrayLike = 0.0,
    stored: float = 0.0,
    fastest: float | None = None,
    limit: float | None = None,
    laws: Sequence[str] | None = None,
    seed: int = 0,
    patience: float = PATIENCE,
    edge: bool = False,
    effort: float = 1.0,
    progress: Callable[[int, int], None] | None = None,
) -> ForceReport:
    """Search for a motion of the hand that draws energy from a force law, and for what the law
    needs of the device.

    Parameters
    ----------
    law : the force on the hand [N]: a function of position x [m] and velocity v [m/s], numbers if
        `start` is a number, else arrays (d,); or an object with `step(x, v)` and `reset()` or
        `reset(dt)`; a class of such objects; a coupled loop (`verification.port.coupled`).
    device : the bare device.
    start : where the hand starts, at rest: a number, or 2 or 3 coordinates [m].
    stored : energy that the law may give from there [J].
    fastest : also measure what hands without frequencies above this [Hz] need.
    limit : largest force [N].
    laws : names of the laws to judge; default: all.
    seed : of the search.
    patience : [s] after which the search ends; the report then fails and says so.
    edge : also search the edge of the passive set in (b, f_c).
    effort : share of the calls of the law that the search makes.
    progress : called with (step, steps) of the search.

    Returns
    -------
    ForceReport
        `passed`, the numbers, each law, and the smallest motion found, also as a test to paste.

    Raises
    ------
    ArgumentError
        The law is no function and has no `step`; a law's name is unknown; a coupled loop has
        another rate than the device; `fastest` or `limit` is not above 0; `stored` is negative.

    Notes
    -----
    What is found was drawn in full by a motion from rest, so a passive law is never refused. A
    law that is not passive may pass, if the search misses the motion: docs/haptic_loop.md says how
    often.

    Examples
    --------
    >>> check_force(lambda x, v: -2000.0 * max(x, 0.0), BareDevice(damping=2.0)).passed
    True
    """
    began = time.monotonic()
    chosen = FORCE_LAWS if laws is None else laws_named(FORCE_LAWS, laws)
    if not (callable(law) or hasattr(law, "step") or hasattr(law, "follow")):
        raise ArgumentError("law", law, "a function of (x, v), or an object with step(x, v)")
    if hasattr(law, "follow") and law.rate != device.rate:
        raise ArgumentError("rate", device.rate, f"{law.rate:g} Hz, the rate of the scene")
    for name, value in (("fastest", fastest), ("limit", limit)):
        if value is not None and not 0.0 < value < np.inf:
            raise ArgumentError(name, value, "a finite number above 0, or None")
    if not 0.0 <= stored < np.inf:
        raise ArgumentError("stored", stored, "a finite number, 0 or more")
    if not isinstance(device, BareDevice):
        raise ArgumentError("device", device, "a BareDevice")
    at = start_of(start)
    port = Port(law, device, len(at))
    goals = Goal(None, device.friction), Goal(device.damping, None)
    rng = np.random.default_rng(seed)
    search = Search(port, at, stored, goals, rng, began + patience, effort=effort)
    terms = Terms(stored, limit)
    trial = _Trial(search, chosen, terms)
    for done, _ in enumerate(trial.stages(fastest, edge)):
        if progress is not None:
            progress(done + 1, len(STAGES))
    unfinished = ""
    if trial.fault and "finite" not in chosen:
        unfinished = f"it gave no force in a motion of the search: {trial.fault}"
    if trial.damping == np.inf and "energy" in chosen and trial.verdicts["energy"].passed:
        unfinished = (
            "no damping is enough: a slower or smaller motion than those tried draws energy"
        )
    if search.late and not trial.fault:
        unfinished = f"too slow: the search did not end in {patience:g} s; numbers are lower bounds"
    return ForceReport(
        name_of(law),
        device,
        terms,
        seed,
        tuple(trial.verdicts.values()),
        np.nan if trial.fault else trial.damping,
        np.nan if trial.fault else trial.friction,
        fastest,
        trial.slow,
        trial.edge,
        tuple(trial.counterexamples()),
        law,
        port.calls,
        time.monotonic() - began,
        unfinished,
    )


class _Trial:
    """One check: the search, the laws judged, their verdicts, and the numbers found so far."""

    def __init__(self, search: Search, laws: dict[str, Law], terms: Terms) -> None:
        self.search = search
        self.laws = laws
        self.terms = terms
        self.verdicts = {
            name: ForceVerdict(name, statement=own.statement) for name, own in laws.items()
        }
        self.damping = 0.0
        self.friction = 0.0
        self.slow: float | None = None
        self.edge = np.empty((0, 2))
        self.fault = ""  # why the law gave no force in the search

    def stages(self, fastest: float | None, edge: bool) -> Iterator[None]:
        """Do the stages of the check, one at each step."""
        search = self.search
        for motion in islice(search.drawn(), MOTIONS):
            for name in self.laws:
                self.judge(name, motion)
            if any(verdict.fault for verdict in self.verdicts.values()):
                break
        yield
        try:
            yield from self.searches(fastest, edge)
        except NoForce as error:
            self.fault = str(error)
            self.judge("finite", error.motion)
            for goal in search.goals:
                for one in search.ranked(goal)[:1]:
                    self.judge("energy", one.motion)
        if search.largest is not None:
            self.judge("bounded", search.largest.motion)

    def searches(self, fastest: float | None, edge: bool) -> Iterator[None]:
        """Do the stages that search; raises NoForce."""
        search = self.search
        search.look()
        yield
        damping_goal, friction_goal = search.goals
        most = [search.most(goal) for goal in search.goals]
        self.damping, self.friction = (one.needed for one in most)
        other = search.from_rest(friction_goal, most[0].motion, LONG)  # it needs some friction, too
        self.friction = max(self.friction, other.needed)
        if search.unbounded(damping_goal, most[0].motion):
            self.damping = np.inf
        if self.damping == np.inf:
            slower = [one_pass(most[0].motion, 2**k) for k in range(SLOWER + 1)]
            most += [search.from_rest(friction_goal, one, 0) for one in slower]
            self.friction = max(self.friction, *(one.needed for one in most[1:]))
        for one in most:
            self.judge("energy", one.motion)
        yield
        if fastest is not None and not search.late:
            effort = SLOW_EFFORT * search.effort
            slow = replace(
                search, goals=(damping_goal,), fastest=fastest, best={}, planes=[], effort=effort
            )
            slow.look()
            self.slow = slow.most(damping_goal).needed
        yield
        if edge and not search.late:
            self.edge = self.edge_found()
        yield

    def edge_found(self) -> Floats:
        """Return points (b, f_c) of the edge, from 0 to beyond the device and its corner."""
        device = self.search.device
        corner = self.damping
        if not np.isfinite(corner):  # with twice the friction that a large damping leaves
            friction = max(self.friction, device.friction)
            corner = max(self.known_best(Goal(None, k * friction)).needed for k in (2.0, 1.0))
        top = 2.0 * max(corner, device.damping, 1e-6)
        for damping in np.linspace(0.0, top, EDGE):
            self.known_best(Goal(float(damping), None))
        dampings = np.linspace(0.0, top, 200)
        return np.stack([dampings, edge_of(self.search.planes, dampings)], axis=1)

    def known_best(self, goal: Goal) -> Found:
        """Search a goal, beginning with known motions."""
        effort = EDGE_EFFORT * self.search.effort
        own = replace(self.search, goals=(goal,), best={}, longest=LONG, effort=effort)
        for motion in self.search.known():
            own.try_on(motion)
        own.look()
        return own.most(goal)

    def judge(self, name: str, motion: Motion) -> None:
        """Judge a law on a motion, if the law was chosen."""
        if name not in self.laws:
            return
        verdict = self.verdicts[name]
        residual, fault = residual_of(self.laws[name], motion, self.search.port, self.terms)
        if residual is None or (fault and name != "finite" and "finite" in self.laws):
            return
        if not verdict.add(residual) and verdict.motion is None:
            verdict.motion = motion
            verdict.fault = fault

    def counterexamples(self) -> Iterator[tuple[str, Motion, str]]:
        """Yield each broken law with a small motion, and what the law did."""
        for name, verdict in self.verdicts.items():
            if verdict.motion is None:
                continue
            breaks = partial(self.breaks, name, time.monotonic() + SHRINKING)
            motions = [verdict.motion]
            if name == "energy":
                motions += islice(self.shorter(breaks), ENOUGH)
            motion = shrink(min(motions, key=_samples), breaks, smaller_motions)
            yield name, motion, verdict.fault

    def breaks(self, name: str, ends: float, motion: Motion) -> bool:
        """Whether a motion breaks a law, found before a time."""
        if time.monotonic() > ends:
            return False
        residual, _ = residual_of(self.laws[name], motion, self.search.port, self.terms)
        return residual is not None and not residual.passed

    def shorter(self, breaks: Callable[[Motion], bool]) -> Iterator[Motion]:
        """Yield a few short motions that draw energy."""
        for motion in sorted(self.search.known(), key=_samples):
            longer = (replace(motion, repeats=times * motion.repeats) for times in (1, 8, 64))
            drawing = next(filter(breaks, longer), None)
            if drawing is not None:
                yield self.cut(drawing)

    def cut(self, motion: Motion) -> Motion:
        """Return the first samples of a motion, until the hand has drawn energy."""
        positions = motion.positions
        device = self.search.device
        sums = sums_of(positions, self.search.port.forces(positions), device.dt)
        drawn = sums.drawn(device.damping, device.friction) > self.terms.stored
        samples = 1 + int(np.argmax(drawn))
        if samples <= len(motion.lead) + 2 * len(motion.cycle):
            return Motion(motion.start, positions[1 : samples + 1], motion.cycle[:0], 0)
        return replace(motion, repeats=-(-(samples - len(motion.lead)) // len(motion.cycle)))


def _samples(motion: Motion) -> int:
    return len(motion.positions)
