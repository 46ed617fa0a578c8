"""`check_force(law, device)`: does a force law ever give energy to the hand, and what device would
it need?"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iapb.errors import ArgumentError
from reference import Floats
from verification.laws.bounds import Law, LawCount
from verification.laws.child import Child, child_of
from verification.laws.counterexample import (
    HANGS,
    import_line,
    name_of,
    residual_of,
    shrink,
    written,
)
from verification.laws.kit import CALL_LIMIT, PATIENCE, Report, laws_named
from verification.port.device import BareDevice, Motion, Port, start_of, sums_of
from verification.port.laws import FORCE_LAWS, Terms, smaller_motions
from verification.port.search import LONG, Found, Goal, Search, edge_of

MOTIONS = 40  # for the laws other than energy
SLOW_CALLS = 30_000  # of the law in the search for slow hands
STAGES = ("laws", "motions of the hand", "their improvement", "slow hands", "edge of the map")
EDGE = 9  # points of the edge that are searched
EDGE_CALLS = 25_000  # of the law for each of them
REMEMBERS = ("repeatable", "waiting")  # laws whose counterexamples need a law without a past
ENOUGH = 4  # motions that break the energy law, of which the shortest is shrunk
SHRINKING = 5.0  # [s] for a counterexample


@dataclass
class ForceVerdict(LawCount):
    """Verdict on one law: `motion` is the first one that breaks it, `fault` what the law did then."""

    statement: str = ""
    motion: Motion | None = None
    fault: str = ""

    @property
    def passed(self) -> bool:
        """Whether no motion broke the law."""
        return self.failures == 0

    def __str__(self) -> str:
        mark = "kept  " if self.passed else "BROKEN"
        worst = f", worst {self.worst.words}" if self.worst else ""
        fault = f"\n         {self.fault}" if self.fault else ""
        return f"  {mark} {self.law}: {self.statement}{worst}{fault}"


@dataclass(frozen=True, eq=False, repr=False)
class ForceReport(Report):
    """Report of `check_force`.

    Attributes
    ----------
    damping_needed : least b [N s/m] at the device's friction for any hand; infinite if no damping is
        enough, as a loop shows.
    friction_needed : least f_c [N] at the device's damping.
    slow_damping : least b for hands without frequencies above `fastest` [Hz], measured; None
        without `fastest`.
    edge : (n, 2) points (b, f_c) on the edge of the passive set, if asked for.
    found : the laws broken, each with a small motion, what the law did, and whether a fresh law did
        it again (None: not tried).
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
    found: tuple[tuple[str, Motion, str, bool | None], ...] = ()
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
        parts = (f"{name}={written(getattr(motion, name))}" for name in ("start", "lead", "cycle"))
        lines = [
            "import numpy as np",
            "from verification.port import BareDevice, Motion, judge",
            import_line(self.tested) or "\n# resolver = ...  the force law under test",
            "",
            "",
            f"def test_{law}():",
            f"    device = {self.device!r}",
            "    motion = Motion(",
            *(f"        {part}," for part in parts),
            f"        repeats={motion.repeats},",
            "    )",
            f"    terms = dict(stored={self.terms.stored!r}, limit={self.terms.limit!r})",
            f"    residual = judge({law!r}, resolver, device, motion, **terms)",
            "    assert residual.passed, residual",
        ]
        return "\n".join(lines)

    def _text(self) -> str:
        device = self.device
        word = "passed" if self.passed else "NOT FINISHED" if not self.broken_laws else "FAILED"
        enough = f"{self.damping_needed:.4g} N s/m"
        if self.damping_needed == np.inf:
            enough = "more than any damping"
        lines = [
            f"{self.law}: {word} on a device of {device.damping:g} N s/m and {device.friction:g} N "
            f"at {device.rate:g} Hz",
            f"  any hand: it needs {enough} (with {device.friction:g} N of friction),",
            f"            or {self.friction_needed:.4g} N of friction (with {device.damping:g} N s/m)",
        ]
        if self.slow_damping is not None:
            lines.append(
                f"  hands slower than {self.fastest:g} Hz: {self.slow_damping:.4g} N s/m (measured)"
            )
        if self.unfinished:
            lines.append(f"  {self.unfinished}")
        lines += [str(verdict) for verdict in self.verdicts]
        lines.append(f"  {self.calls:,} calls in {self.seconds:.1f} s, seed {self.seed}")
        for law, motion, fault, fresh in self.found:
            depends = ", which depends on earlier calls" if fresh is False else ""
            title = f"counterexample to {law}{depends}, {len(motion.positions)} samples:"
            lines += ["", title, *([f"  {fault}"] if fault else []), "", "as a test:", ""]
            lines.append(self.test_of(law, motion))
        return "\n".join(lines)


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
    call_limit: float = CALL_LIMIT,
    own_process: bool = False,
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
    call_limit, own_process : as in `check_passivity`, for one motion.
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
        another rate than the device.

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
    at = start_of(start)
    port = Port(law, device, len(at))
    terms = Terms(stored, limit)
    goals = Goal(None, device.friction), Goal(device.damping, None)
    rng = np.random.default_rng(seed)
    with child_of(port.answer, call_limit, name_of(law)) as child:
        if own_process and child is not None:
            port.play = child
        search = Search(port, at, stored, goals, rng, began + patience, effort=effort)
        trial = _Trial(search, chosen, terms, child)
        stages = trial.stages(fastest, edge)
        for done, _ in enumerate(stages):
            if progress is not None:
                progress(done + 1, len(STAGES))
        found = tuple(trial.counterexamples())
    late = search.late and not search.fault
    return ForceReport(
        name_of(law),
        device,
        terms,
        seed,
        tuple(trial.verdicts.values()),
        trial.damping,
        trial.friction,
        fastest,
        trial.slow,
        trial.edge,
        found,
        law,
        port.calls,
        time.monotonic() - began,
        f"too slow: the search did not end in {patience:g} s" if late else "",
    )


class _Trial:
    """One check: the search, the laws judged, their verdicts, and the numbers found so far."""

    def __init__(
        self, search: Search, laws: dict[str, Law], terms: Terms, child: Child | None
    ) -> None:
        self.search = search
        self.laws = laws
        self.terms = terms
        self.child = child
        self.verdicts = {
            name: ForceVerdict(name, statement=own.statement) for name, own in laws.items()
        }
        self.damping = 0.0
        self.friction = 0.0
        self.slow: float | None = None
        self.edge = np.empty((0, 2))

    def stages(self, fastest: float | None, edge: bool) -> Iterator[None]:
        """Do the stages of the check, one at each step."""
        search = self.search
        drawn = search.drawn()
        for _ in range(MOTIONS):
            family, motion = next(drawn)
            for name in self.laws:
                self.judge(name, motion)
            if any(verdict.fault for verdict in self.verdicts.values()):
                break
        yield
        if not search.fault:
            search.look()
        yield
        damping_goal, friction_goal = search.goals
        most = [self.most(goal) for goal in search.goals]
        self.damping, self.friction = (one.needed for one in most)
        if search.unbounded(damping_goal, most[0]):
            self.damping = np.inf
        yield
        judged = {"energy": most, "bounded": [search.largest], "finite": [search.motion_of_fault]}
        for name, ones in judged.items():
            for one in ones:
                if one.motion is not None:
                    self.judge(name, one.motion)
        if fastest is not None:
            slow = replace(search, goals=(damping_goal,), fastest=fastest, best={}, planes=[])
            slow.look(SLOW_CALLS)
            slow.improve(damping_goal)
            self.slow = slow.confirmed(damping_goal).needed
        yield
        if edge:
            self.edge = self.edge_found()
        yield

    def most(self, goal: Goal) -> Found:
        """Improve the best motions for a goal; return the best from rest."""
        self.search.improve(goal)
        return self.search.confirmed(goal)

    def edge_found(self) -> Floats:
        """Return points (b, f_c) of the edge, from 0 to beyond the device and its corner."""
        search = self.search
        device = self.search.device
        known = [one.motion for own in search.best.values() for one in own.values() if one.motion]
        corner = self.damping
        if not np.isfinite(corner):  # with twice the friction that a large damping leaves
            corner = 0.0
            for friction in (2.0, 1.0):
                goal = Goal(None, friction * max(self.friction, device.friction))
                corner = max(corner, self.known_best(goal, known).needed)
        top = 2.0 * max(corner, device.damping, 1e-6)
        for damping in np.linspace(0.0, top, EDGE):
            self.known_best(Goal(float(damping), None), known)
        dampings = np.linspace(0.0, top, 200)
        return np.stack([dampings, edge_of(search.planes, dampings)], axis=1)

    def known_best(self, goal: Goal, known: list[Motion]) -> Found:
        """Search a goal, beginning with known motions."""
        search = self.search
        own = replace(search, goals=(goal,), best={}, longest=LONG)
        for k, motion in enumerate(known):
            own.try_on(motion, f"known {k}")
        own.look(EDGE_CALLS)
        own.improve(goal, 2)
        return own.confirmed(goal)

    def judge(self, name: str, motion: Motion) -> None:
        """Judge a law on a motion."""
        if name not in self.laws:
            return
        verdict = self.verdicts[name]
        residual, fault = residual_of(self.laws[name], motion, self.search.port, self.terms)
        if residual is None or (fault and name != "finite" and "finite" in self.laws):
            return
        if not verdict.add(residual) and verdict.motion is None:
            verdict.motion = motion
            verdict.fault = fault

    def counterexamples(self) -> Iterator[tuple[str, Motion, str, bool | None]]:
        """Yield each broken law with a small motion, what the law did, and whether a fresh law does
        it again."""
        port = self.search.port
        child = self.child
        for name, verdict in self.verdicts.items():
            if verdict.motion is None:
                continue
            ends = time.monotonic() + SHRINKING
            # a law that gives no answer in time is not asked again and again
            hangs = verdict.fault.startswith(HANGS)

            def breaks(motion: Motion, name: str = name, ends: float = ends) -> bool:
                if time.monotonic() > ends:
                    return False
                if child is not None and name in REMEMBERS:
                    child.restart()
                    port.play = child
                residual, _ = residual_of(self.laws[name], motion, port, self.terms)
                return residual is not None and not residual.passed

            motion = verdict.motion
            if not hangs:
                motion = shrink(
                    min(self.breaking(name, breaks), key=_samples), breaks, smaller_motions
                )
            fresh = None
            if child is not None:
                child.restart()
                own = port.play
                port.play = child
                fresh = hangs or breaks(motion, ends=np.inf)
                port.play = own
            yield (
                name,
                motion,
                verdict.fault or (self.search.fault if name == "finite" else ""),
                fresh,
            )

    def breaking(self, name: str, breaks: Callable[[Motion], bool]) -> list[Motion]:
        """Return motions that break a law: the one known, and for energy the best of each family."""
        first = self.verdicts[name].motion
        known = [] if first is None else [first]
        if name != "energy":
            return known
        every = [one for own in self.search.best.values() for one in own.values()]
        for one in sorted(every, key=lambda one: one.motion is None or _samples(one.motion)):
            for times in (1, 8, 64):
                if one.motion is None or len(known) > ENOUGH:
                    break
                motion = replace(one.motion, repeats=times * one.motion.repeats)
                if breaks(motion):
                    known.append(self.cut(motion))
                    break
        return known

    def cut(self, motion: Motion) -> Motion:
        """Return the first samples of a motion, until the hand has drawn energy."""
        positions = motion.positions
        device = self.search.device
        sums = sums_of(positions, self.search.port.forces(positions), device.dt)
        drawn = sums.drawn(device.damping, device.friction) > self.terms.stored
        samples = 2 + int(np.argmax(drawn))
        if samples <= len(motion.lead) + 1 + 2 * len(motion.cycle):
            return Motion(motion.start, positions[1:samples], motion.cycle[:0], 0)
        return replace(motion, repeats=-(-(samples - 1 - len(motion.lead)) // len(motion.cycle)))


def _samples(motion: Motion) -> int:
    return len(motion.positions)
