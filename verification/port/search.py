"""The search for the motion of the hand that draws most energy, and the edge of the passive set.

Each motion gives a half-plane in (b, f_c): by its end, b Σ|Δx|²/T + f_c Σ|Δx| ≥ Σ F·Δx − stored
must hold. The passive set is what all half-planes share, so it is convex. A *goal* fixes b or f_c
and asks for the least other one. Cycles count with the energy of one round once they have settled;
what the search returns was drawn from rest, in full.

The search tries chatter between pairs of points that a slow scan finds steep, turns (sines and
ellipses), ramps to and fro, polygons and walks; then it improves the best of each speed for each
goal, with changes of its shape, place, speed and points.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from iapb.errors import IapbError
from reference import Floats
from verification.laws.resolver import ResolverFault
from verification.port.device import BareDevice, Motion, Port, Sums, sums_of

CALLS = 120_000  # of the law in the first round
CLIMB = 40_000  # calls for each improved motion, and coordinate
LEADS = (2, 10, 40, 200)  # samples of a lead-in
HALVINGS = 30  # of a pair of points
LASTS = 4  # times as long does a cycle last that is the best so far
SETTLE = 60  # samples after which a cycle is measured
LONG = 40_000  # samples of a motion that confirms a cycle, at first
LONGEST = 360_000  # and at most, if that shows 0.2 % more
FINEST = 1e-7  # smallest size of a cycle, as a share of the reach
SLOWEST = 1000  # samples of a cycle of a hand of any speed
STRAIGHT = 150  # samples of a sine along the only line there is; the scan is slower
SCAN = 400  # samples of a scan from end to end
SLOWER = 6  # loops, each at half the speed of the one before, that show that no damping is enough
SMALLER = 10  # the same for pairs of points, each half as far apart


class Goal(NamedTuple):
    """The least b [N s/m] at a friction, or the least f_c [N] at a damping; the other is None."""

    damping: float | None
    friction: float | None

    def needed(self, sums: Sums, stored: float = 0.0) -> Floats:
        """Return what the motion needs by the end of each period (n,)."""
        spared = sums.work - sums.rounding - stored
        above = spared - (self.friction or 0.0) * sums.rubbed - (self.damping or 0.0) * sums.damped
        below = sums.rubbed if self.friction is None else sums.damped
        return np.divide(above, below, out=np.full_like(above, -np.inf), where=below > 0.0)


@dataclass(frozen=True)
class Found:
    """A motion and what it needs of a goal."""

    needed: float
    motion: Motion


class NoForce(IapbError):
    """The law gave no usable answer in a motion."""

    def __init__(self, fault: ResolverFault, motion: Motion) -> None:
        super().__init__(str(fault))
        self.motion = motion


@dataclass
class Search:
    """One search: the port, where it starts, how far the hand goes, and what was found.

    fastest : largest frequency of the hand [Hz]; the search then uses turns only
    best : of each goal, and of each speed (0: no cycle; 2 samples: 2; 3 and 4: 3; 5 to 8: 4; …) the
        best motion
    planes : (work, damped, rubbed) of motions from rest, less what was stored
    """

    port: Port
    start: Floats
    stored: float
    goals: tuple[Goal, ...]
    rng: np.random.Generator
    ends: float = np.inf
    fastest: float = np.inf
    best: dict[Goal, dict[int, Found]] = field(default_factory=dict)
    planes: list[tuple[float, float, float]] = field(default_factory=list)
    largest: Found | None = None  # the largest force [N]
    longest: int = LONGEST
    effort: float = 1.0  # share of the calls

    @property
    def device(self) -> BareDevice:
        """The bare device."""
        return self.port.device

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.ends

    @property
    def slow(self) -> bool:
        """Whether the hand is slow."""
        return self.fastest < np.inf

    @property
    def shortest(self) -> int:
        """Fewest samples in a turn of the hand."""
        return max(2, int(np.ceil(self.device.rate / self.fastest)))

    @property
    def slowest(self) -> int:
        """Most samples in a cycle of the hand."""
        return max(SLOWEST, 8 * self.shortest)

    def forces(self, motion: Motion) -> Floats:
        """Return the forces (n, d) in a motion; raises NoForce."""
        try:
            forces = self.port.forces(motion.positions)
        except ResolverFault as fault:
            raise NoForce(fault, motion) from None
        with np.errstate(over="ignore"):
            largest = float(np.linalg.norm(forces, axis=1).max())
        if self.largest is None or largest > self.largest.needed:
            self.largest = Found(largest, motion)
        return forces

    def sums(self, motion: Motion) -> Sums:
        """Play a motion; raises NoForce."""
        return sums_of(motion.positions, self.forces(motion), self.device.dt)

    def try_on(self, motion: Motion, *goals: Goal) -> float:
        """Play a motion and keep it where it is the best; return what it needs of the last goal."""
        sums = self.sums(motion)
        speed = max(0, 2 * len(motion.cycle) - 2).bit_length()
        value = -np.inf
        for goal in goals or self.goals:
            of_goal = self.best.setdefault(goal, {})
            best = of_goal[speed].needed if speed in of_goal else -np.inf
            value = self.value(goal, motion, sums)
            if value > best and motion.repeats > 1:  # does it go on like that?
                longer = replace(motion, repeats=LASTS * motion.repeats)
                value = min(value, self.value(goal, longer, self.sums(longer)))
            if value > best:
                of_goal[speed] = Found(value, motion)
        return value

    def value(self, goal: Goal, motion: Motion, sums: Sums) -> float:
        """Return what a motion needs from rest, or with `longest` samples more of its last rounds; of
        a slow hand what these rounds need."""
        if self.slow:
            return float(goal.needed(rounds_of(motion, sums))[0])
        whole = float(goal.needed(sums, self.stored).max())
        if motion.repeats < 2:
            return whole
        rounds = rounds_of(motion, sums)
        more = self.longest / (motion.repeats // 2 * len(motion.cycle))
        long = Sums(*(one[-1:] + more * own for one, own in zip(sums, rounds, strict=True)))
        return max(whole, float(goal.needed(long, self.stored)[0]))

    def motion(self, cycle: Floats, way: int = 0) -> Motion:
        """Return a motion with a cycle, inside the reach; `way`: samples of the lead-in."""
        cycle = np.clip(cycle - self.start, -self.device.reach, self.device.reach) + self.start
        way = 2 * self.shortest if self.slow else way or int(self.rng.choice(LEADS))
        share = np.sin(0.5 * np.pi * np.arange(1, way)[:, None] / way) ** 2
        lead = self.start + share * (cycle[0] - self.start)
        repeats = 2 * int(np.ceil(SETTLE / len(cycle)))
        return Motion(self.start, lead, cycle, repeats)

    # the first round

    def look(self) -> None:
        """Try motions of every kind until CALLS calls of the law are made."""
        last = self.port.calls + self.effort * CALLS
        if not self.slow:
            for motion in itertools.chain(self.steep(), self.edges()):
                self.try_on(motion)
        for motion in self.drawn():
            if self.port.calls > last or self.late:
                return
            self.try_on(motion)

    def direction(self) -> Floats:
        """Return a random unit vector (d,), an axis in half of the draws."""
        size = len(self.start)
        drawn = self.rng.normal(size=size)
        if self.rng.random() < 0.5:
            drawn = np.sign(drawn) * (np.arange(size) == self.rng.integers(size))
        return drawn / np.linalg.norm(drawn)

    def steep(self) -> Iterator[Motion]:
        """Scan lines slowly; yield chatter between the pairs of points that need most."""
        size = len(self.start)
        reach = self.device.reach
        way = np.concatenate([np.linspace(0.0, reach, SCAN), np.linspace(reach, -reach, 2 * SCAN)])
        for line in [*np.eye(size), *(self.direction() for _ in range(3 * (size - 1)))]:
            scan = Motion(self.start, self.start + way[:, None] * line, np.empty((0, size)), 0)
            self.try_on(scan)
            force = self.forces(scan)
            if self.late:
                return
            at = scan.positions
            for lag in 2 ** np.arange(int(np.log2(SCAN))):
                far = at[lag:] - at[:-lag]
                length = np.linalg.norm(far, axis=1)
                rise = np.einsum("ij,ij->i", force[:-lag] - force[lag:], far)
                pair = Sums(rise, 2.0 * length**2 / self.device.dt, 2.0 * length, 0.0 * rise)
                for goal in self.goals:
                    k = int(goal.needed(pair).argmax())
                    yield self.motion(at[k : k + lag + 1 : lag], 20)

    def edges(self) -> Iterator[Motion]:
        """Yield chatter across the encoder's edges near the start, of many sizes."""
        step = self.device.resolution
        if step == 0.0:
            return
        for k in range(4):
            axis = k % len(self.start)
            edge = self.start.copy()
            edge[axis] = (np.floor(edge[axis] / step) + 0.5 + k) * step
            for size in step * 10.0 ** -np.arange(0.3, 5.0, 0.5):
                line = size * np.eye(len(edge))[axis]
                yield self.motion(edge + np.stack([line, -line]), 40)

    def placed(self, shape: Floats) -> Floats:
        """Return a shape (p, d) in a random size and place, often near an earlier find or an edge of
        the encoder."""
        rng = self.rng
        reach = self.device.reach
        size = reach * 10.0 ** rng.uniform(-3.5, -0.1)
        cycles = [motion.cycle for motion in self.known() if len(motion.cycle)]
        near = rng.choice([1.0, 10.0 ** rng.uniform(-4.0, 0.0)])
        middle = near * rng.uniform(-reach, reach, len(self.start))
        if cycles and rng.random() < 0.5:
            middle = cycles[rng.integers(len(cycles))].mean(axis=0) - self.start
        step = self.device.resolution
        if step > 0.0 and rng.random() < 0.5:
            middle = (np.floor((middle + self.start) / step) + 0.5) * step - self.start
        middle = np.clip(middle, size - reach, reach - size)
        return self.start + middle + size / np.abs(shape).max() * shape

    def drawn(self) -> Iterator[Motion]:
        """Yield random motions of every kind for ever."""
        for k in itertools.count():
            yield self.motion(self.placed(self.turn()))
            if not self.slow:
                yield self.motion(self.placed(self.ramps()))
                yield self.motion(self.placed(self.polygon()))
            if not self.slow and k % 3 == 0:
                way = self.motion(self.placed(self.walk()))
                yield Motion(self.start, way.cycle, way.cycle[:0], 0)

    def turn(self) -> Floats:
        """Return a sine, or an ellipse in more dimensions."""
        rng = self.rng
        longest = self.slowest if len(self.start) > 1 or self.slow else STRAIGHT
        p = int(
            self.shortest * (longest / self.shortest) ** rng.random() ** (3 if self.slow else 1)
        )
        turns = 1 if self.slow or rng.random() < 0.7 else int(rng.integers(1, 1 + p // 2))
        angle = 2.0 * np.pi * turns * np.arange(p)[:, None] / p + rng.uniform(0.0, 6.3)
        across = self.direction() * rng.choice([0.0, 1.0, rng.uniform()])
        return np.cos(angle) * self.direction() + np.sin(angle) * across

    def ramps(self) -> Floats:
        """Return a ramp to and fro of up to 12 samples each way, perhaps with rests at its ends."""
        up = np.linspace(-1.0, 1.0, 2 + int(self.rng.integers(12)))
        rest = np.ones(int(self.rng.choice([0, 0, 1, 3])))
        return np.concatenate([up, rest, up[:0:-1], -rest])[:, None] * self.direction()

    def polygon(self) -> Floats:
        """Return a random closed polygon; in half of them the steps differ much."""
        rng = self.rng
        points = rng.normal(size=(int(rng.integers(2, 11)), len(self.start)))
        if rng.random() < 0.5:
            points = np.cumsum(points * 10.0 ** rng.uniform(-3.0, 0.0, (len(points), 1)), axis=0)
        return points

    def walk(self) -> Floats:
        """Return a random motion that does not close: a walk with rests, and perhaps a sine."""
        rng = self.rng
        n = int(rng.integers(3, 150))
        moves = rng.normal(size=(n, len(self.start))) * (rng.random((n, 1)) < rng.uniform())
        sine = np.sin(rng.uniform(0.0, np.pi) * np.arange(n))[:, None] * self.direction()
        return np.cumsum(moves, axis=0) / np.sqrt(n) + rng.choice([0.1, 1.0]) * sine

    # improvement

    def most(self, goal: Goal) -> Found:
        """Improve the best motions for a goal; return the best from rest."""
        self.improve(goal)
        return self.confirmed(goal)

    def improve(self, goal: Goal) -> None:
        """Improve the best cycles of some speeds for a goal, and then again the best of all."""
        for rank in (0, 1, 2, 0):
            cyclic = [one for one in self.ranked(goal) if len(one.motion.cycle)]
            for one in cyclic[rank : rank + 1]:
                self.climb(goal, self.cornered(goal, one))

    def known(self) -> list[Motion]:
        """Return the best motions of all speeds for all goals."""
        return [one.motion for found in self.best.values() for one in found.values()]

    def ranked(self, goal: Goal) -> list[Found]:
        """Return the best motions of each speed for a goal, the best first."""
        return sorted(self.best.get(goal, {}).values(), key=lambda one: -one.needed)

    def cornered(self, goal: Goal, one: Found) -> Found:
        """Halve a pair of points as long as one half needs more: a step of the force is cornered."""
        for _ in range(HALVINGS):
            if len(one.motion.cycle) != 2 or self.late:
                return one
            halves = [self.motion(half) for half in halves_of(one.motion.cycle)]
            values = [self.try_on(half, goal) for half in halves]
            better = int(np.argmax(values))
            if not values[better] > 1.0001 * max(one.needed, 0.0):
                return one
            one = Found(values[better], halves[better])
        return one

    def climb(self, goal: Goal, one: Found) -> None:
        """Change a cycle at random, and keep what needs more."""
        best = one.motion
        value = one.needed
        failed = 0
        last = self.port.calls + self.effort * len(self.start) * CLIMB
        while not (self.late or failed > 50 * len(self.start) or self.port.calls > last):
            cycle = self.changed(best.cycle, 10.0 ** self.rng.uniform(-2.5, 0.0))
            if np.ptp(cycle, axis=0).max() < FINEST * self.device.reach:
                failed += 1
                continue
            way = 0 if self.rng.random() < 0.1 else len(best.lead) + 1
            tried = self.motion(cycle, way)
            found = self.try_on(tried, goal)
            failed = 0 if found > value * 1.0005 else failed + 1
            if found > value:
                best = tried
                value = found

    def changed(self, cycle: Floats, step: float) -> Floats:
        """Return a cycle with one random change of a relative size."""
        rng = self.rng
        (p, size) = cycle.shape
        middle = cycle.mean(axis=0)
        spread = np.linalg.norm(cycle - middle, axis=1).max()
        kind = int(rng.integers(1 - size, 4 if self.slow else 6))
        if kind <= 0:  # larger, turned or bent
            return middle + (cycle - middle) @ (np.eye(size) + step * rng.normal(size=(size, size)))
        if kind == 1:  # elsewhere
            return cycle + step * spread * rng.normal(size=size)
        if kind == 2:  # slower or faster, perhaps of several rounds
            cycle = np.tile(cycle, (1 if self.slow or p > 40 else int(rng.integers(1, 4)), 1))
            p = len(cycle)
            other = rng.choice([p // 2, p - 1, p + 1, round(p * 1.2), round(p / 1.2), 2 * p])
            return resampled(cycle, int(np.clip(other, self.shortest, self.slowest)))
        if kind == 3:  # with a wave
            turn = rng.integers(1, p // self.shortest + 1) * 2.0 * np.pi * np.arange(p)[:, None] / p
            wave = np.cos(turn) * rng.normal(size=size) + np.sin(turn) * rng.normal(size=size)
            return cycle + 0.5 * step * spread * wave
        k = int(rng.integers(1, p))
        if kind == 4:  # one step longer or shorter
            longer = float(np.exp(2.0 * rng.normal())) - 1.0
            return cycle + (np.arange(p) >= k)[:, None] * longer * (cycle[k] - cycle[k - 1])
        return cycle + (np.arange(p) == k)[:, None] * step * spread * rng.normal(size=size)

    # what was found

    def confirmed(self, goal: Goal) -> Found:
        """Return the motion from rest that needs most: the best cycles are repeated for long.

        When the time is over, the best one is still played once: what it needs is a lower bound.
        """
        rest = Motion(self.start, self.start[None], np.empty((0, len(self.start))), 0)
        best = Found(0.0, rest)
        for one in self.ranked(goal)[:4]:
            for samples in (LONG, self.longest):
                in_time = best.motion is rest or not self.late
                if one.needed > 1.002 * best.needed and in_time:
                    tried = self.from_rest(goal, one.motion, round(self.effort * samples))
                    best = max(best, tried, key=lambda own: own.needed)
        return best

    def from_rest(self, goal: Goal, motion: Motion, samples: int) -> Found:
        """Play a motion from rest for so many samples; return what it needs, and keep its
        half-plane."""
        if len(motion.cycle):
            motion = replace(motion, repeats=8 + samples // len(motion.cycle))
        sums = self.sums(motion)
        if self.slow:
            return Found(self.value(goal, motion, sums), motion)
        needed = goal.needed(sums, self.stored)
        at = int(needed.argmax())
        work = float(sums.work[at] - sums.rounding[at] - self.stored)
        self.planes.append((work, sums.damped[at], sums.rubbed[at]))
        return Found(float(needed[at]), motion)

    def unbounded(self, goal: Goal, motion: Motion) -> bool:
        """Whether no damping is enough: a single pass gives as much at each half of its speed, a loop
        needs twice as much, or chatter at each half of its size."""
        cycle = motion.cycle
        if self.gives_once(motion):
            return True
        if not len(cycle):
            return False
        loop = resampled(cycle, int(np.clip(len(cycle), 24, 48)))
        slower = [resampled(loop, len(loop) * 2**k) for k in range(SLOWER)]
        if _doubles([self.settled(goal, copy) for copy in slower]):
            return True
        pairs = [np.stack([a, b]) for a, b in zip(cycle, np.roll(cycle, 1, 0), strict=True)][:40]
        found = list[float]()
        for _ in range(SMALLER):
            values = [self.settled(goal, pair) for pair in pairs]
            best = int(np.argmax(values))
            found.append(values[best])
            pairs = halves_of(pairs[best])
        return _doubles(found)

    def gives_once(self, motion: Motion) -> bool:
        """Whether one pass of a motion gives as much energy at each half of its speed: what the law
        had at the start, of which a slow hand loses nothing."""
        given = list[float]()
        for k in range(SLOWER):
            sums = self.sums(one_pass(motion, 2**k))
            given.append(float((sums.work - sums.rounding).max()) - self.stored)
        last = given[-4:]
        return last[0] > 0.0 and all(b > 0.9 * a for a, b in itertools.pairwise(last))

    def settled(self, goal: Goal, cycle: Floats) -> float:
        """Return what the last rounds of a cycle need, whatever came before."""
        motion = self.motion(cycle, 40)
        return float(goal.needed(rounds_of(motion, self.sums(motion)))[0])


def one_pass(motion: Motion, slower: int) -> Motion:
    """Return one pass of a motion, so many times slower."""
    path = np.vstack([motion.start, motion.lead, motion.cycle])
    at = np.arange(len(path))
    fine = np.linspace(0.0, at[-1], at[-1] * slower + 1)
    line = np.stack([np.interp(fine, at, each) for each in path.T], axis=1)
    return Motion(motion.start, line[1:], motion.cycle[:0], 0)


def rounds_of(motion: Motion, sums: Sums) -> Sums:
    """Return the sums (1,) of the second half of a motion's rounds."""
    last = motion.repeats // 2 * len(motion.cycle)
    return Sums(*(one[-1:] - one[-1 - last] for one in sums))


def _doubles(needed: list[float]) -> bool:
    """Whether each of the last numbers is nearly twice the one before."""
    last = needed[-4:]
    return last[0] > 0.0 and all(b > 1.8 * a for a, b in itertools.pairwise(last))


def halves_of(pair: Floats) -> list[Floats]:
    """Return the two halves of a pair of points."""
    middle = pair.mean(axis=0)
    return [np.stack([pair[0], middle]), np.stack([middle, pair[1]])]


def resampled(cycle: Floats, p: int) -> Floats:
    """Return a cycle in p samples, with no new frequencies."""
    lines = np.fft.rfft(cycle, axis=0)[: p // 2 + 1]
    return np.fft.irfft(lines, p, axis=0) * (p / len(cycle))


def edge_of(planes: list[tuple[float, float, float]], dampings: Floats) -> Floats:
    """Return the least friction (n,) [N] that all motions allow at dampings (n,) [N s/m]."""
    work, damped, rubbed = np.array([*planes, (0.0, 0.0, 1.0)]).T
    return ((work - np.outer(dampings, damped)) / rubbed).max(axis=1)
