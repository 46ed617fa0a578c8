"""Study: runs the scenes that the claims call for, each once, and hands out their traces.

    check_claims()                              every claim with `reference.worlds.run_world`
    check_claims(run=lambda scene, world, rendering: ...)     with runs from a store

Nothing is written here; whoever wants the runs kept passes a `run` that keeps them.
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

SEED = 20050601  # of the random instances; the month the paper appeared


def run_directly(scene: Scene, world: str, rendering: str) -> Run:
    """Simulate without a store."""
    return run_world(scene, world, rendering)


@dataclass
class Study:
    """What a claim computes with.

    run : (scene, world, rendering) -> Run
    depth : "quick" or "full", how fine the conditions are
    seed : of the random impacts
    asked : called whenever a claim uses a run, also one that was made for an earlier claim
    ahead : makes many runs at once, one per triple in their order; None where one fails, which is then asked of `run`
    failures : receives the cases that raise; without it their exceptions pass through
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
        """A scene that comes with the project."""
        if name not in self._scenes:
            self._scenes[name] = load_scene(find_scene(name))
        return self._scenes[name]

    def starts(self) -> tuple[Condition, ...]:
        """The starting conditions of the peg at this depth."""
        return start_conditions(self.depth)

    def limited(self) -> tuple[Condition, ...]:
        """The starting conditions of the peg at this depth, with limits of the device."""
        return limited_conditions(self.depth)

    def fresh(self, tested: Sequence[Condition], region: Region, count: int) -> list[Condition]:
        """Conditions drawn inside a region, between the ends of those tested."""
        return drawn(tested, region, self.seed, count)

    def trace(self, condition: Condition, world: str, rendering: str = "full") -> Trace:
        """The peg under a condition in a world, run once for all conditions that this world cannot tell apart."""
        seen = condition.seen_by(world, rendering)
        key = (seen, world, rendering)
        if self.asked is not None:
            self.asked(self.place(seen), world, rendering)
        if key not in self._traces:
            run = self.run(self.place(seen), world, rendering)
            self._traces[key] = trace_of(run)
        return self._traces[key]

    def make_ahead(self, conditions: Iterable[Condition], runs: Iterable[tuple[str, str]]) -> None:
        """Make the runs (world, rendering) of these conditions that are still missing, where there is an `ahead`."""
        if self.ahead is None:
            return
        wanted = [(condition.seen_by(*run), *run) for condition in conditions for run in runs]
        missing = [key for key in dict.fromkeys(wanted) if key not in self._traces]
        found = self.ahead([(self.place(seen), world, rendering) for seen, world, rendering in missing])
        self._traces |= {key: trace_of(run) for key, run in zip(missing, found, strict=True) if run is not None}

    def once(self, key: Hashable, compute: Callable[[], Result]) -> Result:
        """What `compute` returns, computed once for each key."""
        if key not in self._results:
            self._results[key] = compute()
        return cast(Result, self._results[key])

    def place(self, condition: Condition) -> Scene:
        """The peg scene under a condition."""
        if condition not in self._scenes:
            self._scenes[condition] = condition.place(self.scene("peg_corner"))
        return self._scenes[condition]

    @property
    def runs_done(self) -> int:
        """Simulations asked for so far."""
        return len(self._traces)

    def each(self, cases: Iterable[Case], trials: Callable[[Case], Iterable[Result]]) -> Iterator[Result]:
        """Yield the trials of each case; a case that raises is among the `failures`, where there is such a list."""
        return of_each(cases, trials, self.failures)
