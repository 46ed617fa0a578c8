"""Study: runs each scene that the claims need once, and returns its trace.

    check_claims()                              every claim with `reference.worlds.run_world`
    check_claims(run=lambda scene, world, rendering: ...)     with runs from a store

This module writes no files. To keep the runs, pass a `run` that stores them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene
from reference.worlds import run_world
from verification.claims.conditions import Condition, drawn, limited_conditions, start_conditions
from verification.finding import Failure, Region, check_depth, of_each
from verification.scenes.trace import Trace, trace_of

Case = TypeVar("Case")
Result = TypeVar("Result")
Runner = Callable[[Scene, str, str], Run]
Wanted = tuple[Scene, str, str]
Ahead = Callable[[Sequence[Wanted]], Iterable[Run | None]]
Asked = Callable[[Scene, str, str], None]

SEED = 20050601  # seed of the random impacts and conditions: the month in which the paper appeared


def run_directly(scene: Scene, world: str, rendering: str) -> Run:
    """Simulate without a store."""
    return run_world(scene, world, rendering)


@dataclass
class Study:
    """The runs, conditions and cached results that the claims use.

    run : (scene, world, rendering) -> Run
    depth : "quick" or "full"; "full" has more conditions and more impacts
    seed : seed of the random impacts and of the fresh conditions
    asked : called whenever a claim uses a run, even if an earlier claim made that run
    ahead : (scene, world, rendering) triples -> one Run each, in the same order; for a None, `run` is called later
    failures : receives the cases that raise an exception; if it is None, the exceptions propagate
    """

    run: Runner = run_directly
    depth: str = "quick"
    seed: int = SEED
    asked: Asked | None = None
    ahead: Ahead | None = None
    failures: list[Failure] | None = None
    _traces: dict[tuple[Any, ...], Trace] = field(default_factory=dict, repr=False)
    _results: dict[Hashable, Any] = field(default_factory=dict, repr=False)
    _scenes: dict[Any, Scene] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        check_depth(self.depth)

    def scene(self, name: str) -> Scene:
        """Return a scene of the project by name."""
        if name not in self._scenes:
            self._scenes[name] = load_scene(find_scene(name))
        return self._scenes[name]

    def starts(self) -> tuple[Condition, ...]:
        """Return the starting conditions of the peg at this depth."""
        return start_conditions(self.depth)

    def limited(self) -> tuple[Condition, ...]:
        """Return the starting conditions of the peg at this depth, with force limits of the device."""
        return limited_conditions(self.depth)

    def fresh(self, tested: Sequence[Condition], region: Region, count: int) -> list[Condition]:
        """Return `count` conditions drawn at random inside a region and inside the range of those tested."""
        return drawn(tested, region, self.seed, count)

    def trace(self, condition: Condition, world: str, rendering: str = "full") -> Trace:
        """Return the trace of the peg; conditions that differ only in values the world ignores share one run."""
        seen = condition.seen_by(world, rendering)
        key = (seen, world, rendering)
        if self.asked is not None:
            self.asked(self.place(seen), world, rendering)
        if key not in self._traces:
            run = self.run(self.place(seen), world, rendering)
            self._traces[key] = trace_of(run)
        return self._traces[key]

    def make_ahead(self, conditions: Iterable[Condition], runs: Iterable[tuple[str, str]]) -> None:
        """Make the missing runs (world, rendering) of these conditions with `ahead`; without `ahead` do nothing."""
        if self.ahead is None:
            return
        wanted = [(condition.seen_by(*run), *run) for condition in conditions for run in runs]
        missing = [key for key in dict.fromkeys(wanted) if key not in self._traces]
        found = self.ahead([(self.place(seen), world, rendering) for seen, world, rendering in missing])
        self._traces |= {key: trace_of(run) for key, run in zip(missing, found, strict=True) if run is not None}

    def once(self, key: Hashable, compute: Callable[[], Result]) -> Result:
        """Return the result of `compute`, which is called only once for each key."""
        if key not in self._results:
            self._results[key] = compute()
        return cast(Result, self._results[key])

    def place(self, condition: Condition) -> Scene:
        """Return the peg scene under a condition."""
        if condition not in self._scenes:
            self._scenes[condition] = condition.place(self.scene("peg_corner"))
        return self._scenes[condition]

    @property
    def runs_done(self) -> int:
        """Number of distinct runs obtained so far."""
        return len(self._traces)

    def each(self, cases: Iterable[Case], trials: Callable[[Case], Iterable[Result]]) -> Iterator[Result]:
        """Yield the trials of each case; a case that raises is added to `failures` if that list is given."""
        return of_each(cases, trials, self.failures)
