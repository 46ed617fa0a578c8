"""The search for the motion of the hand that draws most energy, and the edge of the passive set.

Each motion gives a half-plane in (b, f_c): by its end, b Σ|Δx|²/T + f_c Σ|Δx| ≥ Σ F·Δx − stored
must hold. The passive set is what all half-planes share, so it is convex. A *goal* fixes b or f_c
and asks for the least other one. Cycles count with the energy of one round once they have settled;
what the search returns was drawn from rest, in full.

The search tries chatter between pairs of points that a slow scan finds steep, turns (sines and
ellipses), ramps and reversals, random cycles and random motions; then it improves the best of each
kind for each goal, with moves of points, scale, place, shape and speed.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference import Floats
from verification.laws.resolver import ResolverFault
from verification.port.device import BareDevice, Motion, Port, Sums, sums_of

CALLS = 90_000  # of the law in the first round
TRIES = 150  # moves of each improved motion
CLIMB = 30_000  # calls of the law for these
LEADS = (2, 10, 40, 200)  # samples of a lead-in
HALVINGS = 30  # of a pair of points
SETTLE = 60  # samples after which a cycle is measured
LONG = 40_000  # samples of a motion that confirms a cycle, at first
LONGEST = 1_500_000  # and at most, if that shows 0.2 % more
PATIENT = 2.0  # [s] for such a motion
FINEST = 1e-7  # smallest size of a cycle, as a share of the reach
PERIODS = (
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
    11,
    13,
    16,
    20,
    26,
    36,
    50,
    72,
    100,
    150,
)  # of turns [samples]
SLOWEST = 1000  # samples of an improved cycle
SCAN = 400  # samples of a scan from end to end
SLOWER = 6  # loops, each at half the speed of the one before, that show that no damping is enough
SMALLER = 10  # the same for pairs of points, each half as far apart


class Goal(NamedTuple):
    """The least b [N s/m] at a friction, or the least f_c [N] at a damping; the other is None."""

    damping: float | None
    friction: float | None

    def needed(self, sums: Sums, stored: float = 0.0) -> Floats:
        """Return what the motion needs by the end of each period (n,)."""
        work = sums.work - sums.rounding - stored
        if self.friction is not None:
            return _over(work - self.friction * sums.rubbed, sums.damped)
        return _over(work - (self.damping or 0.0) * sums.damped, sums.rubbed)


def _over(above: Floats, below: Floats) -> Floats:
    return np.divide(above, below, out=np.full_like(above, -np.inf), where=below > 0.0)


@dataclass(frozen=True)
class Found:
    """A motion and what it needs of a goal; `family` is the kind of motion."""

    needed: float = -np.inf
    motion: Motion | None = None
    family: str = ""


@dataclass
class Search:
    """One search: the port, where it starts, how far the hand goes, and what was found.

    fastest : largest frequency of the hand [Hz]; the search then uses turns only
    best : of each goal, and of each family the best motion
    planes : (work, damped, rubbed) of motions from rest, less what was stored
    """

    port: Port
    start: Floats
    stored: float
    goals: tuple[Goal, ...]
    rng: np.random.Generator
    ends: float = np.inf
    fastest: float = np.inf
    best: dict[Goal, dict[str, Found]] = field(default_factory=dict)
    planes: list[tuple[float, float, float]] = field(default_factory=list)
    largest: Found = field(default_factory=Found)  # the largest force [N]
    longest: int = LONGEST
    effort: float = 1.0  # share of the calls
    fault: str = ""
    motion_of_fault: Found = field(default_factory=Found)

    @property
    def device(self) -> BareDevice:
        """The bare device."""
        return self.port.device

    @property
    def late(self) -> bool:
        """Whether the time is over, or the law gave no usable answer."""
        return bool(self.fault) or time.monotonic() > self.ends

    @property
    def shortest(self) -> int:
        """Fewest samples in a turn of the hand."""
        return max(2, int(np.ceil(self.device.rate / self.fastest)))

    def sums(self, motion: Motion) -> Sums | None:
        """Play a motion; None if the law gave no usable answer."""
        positions = motion.positions
        try:
            forces = self.port.forces(positions)
        except ResolverFault as fault:
            if not self.fault:
                self.fault = str(fault)
                self.motion_of_fault = Found(motion=motion)
            return None
        with np.errstate(over="ignore"):
            largest = float(np.linalg.norm(forces, axis=1).max())
        if largest > self.largest.needed:
            self.largest = Found(largest, motion)
        return sums_of(positions, forces, self.device.dt)

    def try_on(self, motion: Motion, family: str, goals: tuple[Goal, ...] = ()) -> list[float]:
        """Play a motion and keep it where it is the best; return what it needs of each goal."""
        sums = self.sums(motion)
        if sums is None:
            return [-np.inf for _ in goals]
        found = []
        for goal in goals or self.goals:
            value = self.value(goal, motion, sums)
            family_best = self.best.setdefault(goal, {})
            if value > family_best.get(family, Found()).needed:
                family_best[family] = Found(value, motion, family)
            found.append(value)
        return found

    def value(self, goal: Goal, motion: Motion, sums: Sums) -> float:
        """Return what a motion needs from rest, or with LONGEST samples more of its last rounds."""
        whole = -np.inf if self.smooth else float(goal.needed(sums, self.stored).max())
        if motion.repeats < 2:
            return whole
        last = motion.repeats // 2 * len(motion.cycle)
        rounds = Sums(*(one[-1:] - one[-1 - last] for one in sums))
        if self.smooth:
            return float(goal.needed(rounds)[0])
        more = self.longest / last
        long = Sums(*(one[-1:] + more * own for one, own in zip(sums, rounds, strict=True)))
        return max(whole, float(goal.needed(long, self.stored)[0]))

    def motion(self, cycle: Floats, way: int = 0) -> Motion:
        """Return a motion with a cycle, inside the reach; `way`: samples of the lead-in."""
        cycle = np.clip(cycle - self.start, -self.device.reach, self.device.reach) + self.start
        way = way or int(self.rng.choice(LEADS))
        if self.fastest < np.inf:
            way = 2 * self.shortest
        share = np.sin(0.5 * np.pi * np.arange(1, way)[:, None] / way) ** 2
        lead = self.start + share * (cycle[0] - self.start)
        repeats = 2 * int(np.ceil(SETTLE / len(cycle)))
        return Motion(self.start, lead, cycle, repeats)

    # the first round

    def look(self, calls: int = CALLS) -> None:
        """Try every family until so many calls of the law are made."""
        last = self.port.calls + self.effort * calls
        if self.fastest == np.inf:
            for family, motion in itertools.chain(self.steep(), self.edges()):
                self.try_on(motion, family)
        for family, motion in self.drawn():
            if self.port.calls > last or self.late:
                return
            self.try_on(motion, family)

    def direction(self) -> Floats:
        """Return a random unit vector (d,), an axis in half of the draws."""
        size = len(self.start)
        drawn = self.rng.normal(size=size)
        if self.rng.random() < 0.5:
            drawn = np.sign(drawn) * (np.arange(size) == self.rng.integers(size))
        return drawn / np.linalg.norm(drawn)

    def steep(self) -> Iterator[tuple[str, Motion]]:
        """Scan lines slowly; yield chatter between the pairs of points that need most."""
        size = len(self.start)
        reach = self.device.reach
        lines = [*np.eye(size), *(self.direction() for _ in range(3 * (size - 1)))]
        lags = np.array([2**k for k in range(int(np.log2(SCAN)))])
        for line in lines:
            ends = np.array([0.0, reach, -reach, 0.0])[:, None] * line + self.start
            legs = [np.linspace(a, b, SCAN) for a, b in zip(ends[:-1], ends[1:], strict=True)]
            scan = Motion(self.start, np.concatenate(legs), np.empty((0, size)), 0)
            self.try_on(scan, "scan")
            if self.late:
                return
            for at, force in self._legs(scan):
                yield from self._pairs(at, force, line, lags)

    def edges(self) -> Iterator[tuple[str, Motion]]:
        """Yield chatter across the encoder's edges near the start, of many sizes."""
        step = self.device.resolution
        for k in range(4 if step > 0.0 else 0):
            edge = self.start.copy()
            edge[k % len(edge)] = (np.floor(edge[k % len(edge)] / step) + 0.5 + k) * step
            for size in step * 10.0 ** -np.arange(0.3, 5.0, 0.5):
                line = size * (np.arange(len(edge)) == k % len(edge))
                yield "edge", self.motion(np.stack([edge + line, edge - line]), 40)

    def _legs(self, scan: Motion) -> Iterator[tuple[Floats, Floats]]:
        at = scan.positions
        force = self.port.forces(at)
        for k in range(3):
            part = slice(1 + k * SCAN, 1 + (k + 1) * SCAN)
            yield at[part], force[part]

    def _pairs(
        self, at: Floats, force: Floats, line: Floats, lags: NDArray[np.int64]
    ) -> Iterator[tuple[str, Motion]]:
        """Yield chatter between the steepest pairs of a leg, a few for each goal."""
        first, second = np.concatenate(
            [np.stack([np.arange(len(at) - lag), np.arange(lag, len(at))]) for lag in lags], axis=1
        )
        far = at[second] - at[first]
        length = np.linalg.norm(far, axis=1)
        rise = np.einsum("ij,ij->i", force[first] - force[second], far)
        pair = Sums(rise, 2.0 * length**2 / self.device.dt, 2.0 * length, 0.0 * rise)
        for goal in self.goals:
            order = np.argsort(-goal.needed(pair))[:200]
            for k in order[:: max(1, len(order) // 5)]:
                yield "chatter", self.motion(np.stack([at[first[k]], at[second[k]]]), 20)

    def place(self) -> Floats:
        """Return a random place (d,), most often near the middle of an earlier find."""
        reach = self.device.reach
        known = [one.motion for found in self.best.values() for one in found.values()]
        cycles = [motion.cycle for motion in known if motion is not None and len(motion.cycle)]
        if cycles and self.rng.random() < 0.5:
            cycle = cycles[self.rng.integers(len(cycles))]
            return cycle.mean(axis=0)
        near = 10.0 ** self.rng.uniform(-4.0, 0.0) if self.rng.random() < 0.5 else 1.0
        middle = self.start + near * self.rng.uniform(-reach, reach, len(self.start))
        step = self.device.resolution
        if step > 0.0 and self.rng.random() < 0.5:  # an edge of the encoder
            middle = (np.floor(middle / step) + 0.5) * step
        return middle

    def size(self) -> float:
        """Return a random size of a cycle [m]."""
        return self.device.reach * float(10.0 ** self.rng.uniform(-3.5, -0.1))

    def drawn(self) -> Iterator[tuple[str, Motion]]:
        """Yield random motions of every family for ever."""
        k = 0
        slow = self.fastest < np.inf
        while True:
            k += 1
            yield f"turn {k % 4}", self.turn(k)
            if slow:
                continue
            yield "reversal", self.reversal(k)
            yield f"cycle {k % 3}", self.cycle(2 + k % 3 * 3 + int(self.rng.integers(3)))
            if k % 3 == 0:
                yield "walk", self.walk()

    def turn(self, k: int) -> Motion:
        """Return a sine, or an ellipse in more dimensions."""
        wide = (300, 600, 1000) if len(self.start) > 1 else ()
        periods = [p for p in (*PERIODS, *wide, 4 * self.shortest) if p >= self.shortest]
        p = periods[k % len(periods)]
        turns = 1 if self.smooth or p < 5 else int(self.rng.integers(1, 1 + p // 2))
        turns = turns if self.rng.random() < 0.3 else 1
        angle = 2.0 * np.pi * turns * np.arange(p)[:, None] / p + self.rng.uniform(0.0, 6.3)
        middle = self.place()
        size = self.size()
        across = self.direction() * self.rng.choice([0.0, 1.0, self.rng.uniform()])
        shape = np.cos(angle) * self.direction() + np.sin(angle) * across
        size = min(size, self.room(middle))
        return self.motion(middle + size * shape)

    def room(self, middle: Floats) -> float:
        """Return how far the hand can move from a place to all sides [m]."""
        return max(self.device.reach - float(np.abs(middle - self.start).max()), 1e-3 * self.size())

    def reversal(self, k: int) -> Motion:
        """Return a ramp to and fro of up to 12 samples each way, perhaps with rests at its ends."""
        steps = 1 + k % 12
        rest = int(self.rng.choice([0, 0, 1, 3]))
        up = np.linspace(-1.0, 1.0, steps + 1)
        shape = np.concatenate([up, np.repeat(up[-1:], rest), up[:0:-1], np.repeat(up[:1], rest)])
        return self.motion(self.place() + self.size() * shape[:, None] * self.direction())

    def cycle(self, p: int) -> Motion:
        """Return a random closed polygon of p samples; in half of them the steps differ much."""
        points = self.rng.normal(size=(p, len(self.start)))
        if self.rng.random() < 0.5:
            points = np.cumsum(points * 10.0 ** self.rng.uniform(-3.0, 0.0, (p, 1)), axis=0)
        return self.motion(self.place() + self.size() * points)

    def walk(self) -> Motion:
        """Return a random motion that does not close: a walk, rests and a sine."""
        n = int(self.rng.integers(3, 150))
        size = len(self.start)
        moves = self.rng.normal(size=(n, size)) * (self.rng.random((n, 1)) < self.rng.uniform())
        sine = np.sin(self.rng.uniform(0.0, np.pi) * np.arange(n))[:, None] * self.direction()
        path = np.cumsum(moves, axis=0) / np.sqrt(n) + self.rng.choice([0.0, 1.0]) * sine
        lead = self.start + self.size() * path
        motion = self.motion(lead)
        return Motion(self.start, motion.cycle, np.empty((0, size)), 0)

    # improvement

    def improve(self, goal: Goal, kinds: int = 3, tries: int = TRIES) -> None:
        """Improve the best motions of some families for a goal."""
        ranked = sorted(self.best.get(goal, {}).values(), key=lambda one: -one.needed)
        cyclic = [one for one in ranked if one.motion is not None and len(one.motion.cycle)]
        for one in cyclic[:kinds]:
            self.corner(goal, one)
            self.climb(goal, self.best[goal][one.family], tries)

    def corner(self, goal: Goal, one: Found) -> None:
        """Halve a pair of points as long as one half needs more: a step of the force is cornered."""
        for _ in range(HALVINGS):
            family = one.family
            needed = one.needed
            if one.motion is None or len(one.motion.cycle) != 2 or needed <= 0.0 or self.late:
                return
            for half in halves_of(one.motion.cycle):
                self.try_on(self.motion(half, len(one.motion.lead) + 1), family, (goal,))
            one = self.best[goal][family]
            if not one.needed > 1.0001 * needed:
                return

    def climb(self, goal: Goal, one: Found, tries: int) -> None:
        """Change a cycle at random, and keep what needs more."""
        if one.motion is None:
            return
        best = one.motion
        value = one.needed
        step = 0.3
        failed = 0
        last = self.port.calls + self.effort * CLIMB
        for _ in range(tries):
            if self.late or failed > 30 or self.port.calls > last:
                return
            cycle = self.changed(best.cycle, step)
            if np.ptp(cycle, axis=0).max() < FINEST * self.device.reach:
                continue
            way = 0 if self.rng.random() < 0.1 else len(best.lead) + 1
            tried = self.motion(cycle, way)
            found = self.try_on(tried, one.family, (goal,))[0]
            if found > value:
                failed = 0 if found > value * 1.0005 else failed + 1
                best = tried
                value = found
                step = min(1.0, 1.6 * step)
            else:
                failed = failed + 1
                step = max(1e-3, 0.9 * step)

    def changed(self, cycle: Floats, step: float) -> Floats:
        """Return a cycle with one random change of a relative size."""
        rng = self.rng
        p = len(cycle)
        middle = cycle.mean(axis=0)
        spread = np.linalg.norm(cycle - middle, axis=1).max()
        kind = int(rng.integers(6))
        if kind == 0:
            return middle + (cycle - middle) * float(np.exp(2.0 * step * rng.normal()))
        if kind == 1:
            return cycle + step * spread * rng.normal(size=len(middle))
        if kind == 2 and not self.smooth:  # one step longer or shorter
            k = int(rng.integers(1, p))
            longer = float(np.exp(2.0 * rng.normal())) - 1.0
            return cycle + (np.arange(p) >= k)[:, None] * longer * (cycle[k] - cycle[k - 1])
        if kind == 3:
            other = self.shortest if self.fastest < np.inf else 2
            rounds = int(rng.choice([1, 1, 2, 3])) if p < 40 and not self.smooth else 1
            p = p * rounds
            cycle = np.tile(cycle, (rounds, 1))
            longer = rng.choice([p // 2, p - 1, p + 1, round(p * 1.2), round(p / 1.2), 2 * p])
            return resampled(cycle, int(np.clip(longer, other, SLOWEST)), self.smooth)
        if kind == 4 or self.smooth:
            high = max(1, p // self.shortest) if self.smooth else int(rng.integers(1, p // 2 + 1))
            turn = 2.0 * np.pi * high * np.arange(p)[:, None] / p
            wave = np.cos(turn) * rng.normal(size=len(middle))
            wave += np.sin(turn) * rng.normal(size=len(middle))
            return cycle + 0.5 * step * spread * wave
        moved = cycle.copy()
        moved[rng.integers(p)] += step * spread * rng.normal(size=len(middle))
        return moved

    @property
    def smooth(self) -> bool:
        """Whether the hand is slow."""
        return self.fastest < np.inf

    # what was found

    def confirmed(self, goal: Goal) -> Found:
        """Return the motion from rest that needs most: the best cycles are repeated for long."""
        best = Found(0.0)
        ranked = sorted(self.best.get(goal, {}).values(), key=lambda one: -one.needed)
        for one in ranked[:4]:
            samples = round(self.effort * LONG)
            while (
                samples <= self.effort * self.longest
                and one.needed > 1.002 * best.needed
                and not self.late
            ):
                began = time.monotonic()
                best = max(best, self.from_rest(goal, one, samples), key=lambda own: own.needed)
                if one.motion is None or not len(one.motion.cycle) or self.smooth:
                    break
                if 3.0 * (time.monotonic() - began) > PATIENT:
                    break
                samples *= 3
        return best

    def from_rest(self, goal: Goal, one: Found, samples: int) -> Found:
        """Play a motion from rest for so many samples; return what it needs, and keep its
        half-plane."""
        motion = one.motion
        if motion is None:
            return Found()
        if len(motion.cycle):
            motion = replace(motion, repeats=8 + samples // len(motion.cycle))
        sums = self.sums(motion)
        if sums is None:
            return Found()
        if self.smooth:
            return Found(self.value(goal, motion, sums), motion, one.family)
        needed = goal.needed(sums, self.stored)
        at = int(needed.argmax())
        work = float(sums.work[at] - sums.rounding[at] - self.stored)
        self.planes.append((work, float(sums.damped[at]), float(sums.rubbed[at])))
        return Found(float(needed[at]), motion, one.family)

    def unbounded(self, goal: Goal, one: Found) -> bool:
        """Whether no damping is enough: a loop needs twice as much at each half of its speed, or
        chatter at each half of its size."""
        if one.motion is None or not len(one.motion.cycle):
            return False
        cycle = one.motion.cycle
        loop = resampled(cycle, max(24, min(len(cycle), 48)), self.smooth)
        slower = [resampled(loop, len(loop) * 2**k, self.smooth) for k in range(SLOWER)]
        if _doubles([self.settled(goal, copy) for copy in slower]):
            return True
        pairs = [np.stack([a, b]) for a, b in zip(cycle, np.roll(cycle, 1, 0), strict=True)][:40]
        found = list[float]()
        for _ in range(SMALLER):
            values = [self.settled(goal, pair) for pair in pairs]
            best = int(np.argmax(values))
            found.append(values[best])
            pairs = halves_of(pairs[best])
        return not self.smooth and _doubles(found)

    def settled(self, goal: Goal, cycle: Floats) -> float:
        """Return what the last rounds of a cycle need, whatever came before."""
        sums = self.sums(self.motion(cycle, 40))
        if sums is None:
            return -np.inf
        half = (len(sums.work) - 40) // (2 * len(cycle)) * len(cycle)
        return float(goal.needed(Sums(*(one[-1:] - one[-1 - half] for one in sums)))[0])


def _doubles(needed: list[float]) -> bool:
    """Whether each of the last numbers is nearly twice the one before."""
    last = needed[-4:]
    return last[0] > 0.0 and all(b > 1.8 * a for a, b in itertools.pairwise(last))


def halves_of(pair: Floats) -> list[Floats]:
    """Return the two halves of a pair of points."""
    middle = pair.mean(axis=0)
    return [np.stack([pair[0], middle]), np.stack([middle, pair[1]])]


def resampled(cycle: Floats, p: int, smooth: bool = False) -> Floats:
    """Return a cycle in p samples: between its points straight, or with no new frequencies."""
    if p == len(cycle):
        return cycle
    if smooth:
        lines = np.fft.rfft(cycle, axis=0)[: p // 2 + 1]
        return np.fft.irfft(lines, p, axis=0) * (p / len(cycle))
    at = np.arange(p) * len(cycle) / p
    closed = np.concatenate([cycle, cycle[:1]])
    whole = np.arange(len(closed))
    return np.stack([np.interp(at, whole, closed[:, k]) for k in range(cycle.shape[1])], axis=1)


def edge_of(planes: list[tuple[float, float, float]], dampings: Floats) -> Floats:
    """Return the least friction (n,) [N] that all motions allow at dampings (n,) [N s/m]."""
    work, damped, rubbed = np.array([*planes, (0.0, 0.0, 1.0)]).T
    return ((work - np.outer(dampings, damped)) / rubbed).max(axis=1)
