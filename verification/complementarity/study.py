"""`compare` makes the whole comparison as one record; `findings` turns the record into sentences."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from iapb.errors import ArgumentError
from iapb.names import one_of
from iapb.run import Run
from iapb.scene import Scene, find_scene, load_scene, scene_names
from verification.complementarity.agreement import (
    Comparison,
    MapCell,
    TwoContactCell,
    agreement_map,
    compare_cases,
    two_contact_map,
)
from verification.complementarity.cases import random_cases
from verification.complementarity.convergence import CASES, ConvergenceRow, converge
from verification.complementarity.extensions import (
    FrictionCell,
    UnequalCell,
    compare_friction,
    compare_unequal,
    struck_bar,
)
from verification.complementarity.piles import PileRow, compare_piles
from verification.complementarity.problems import ProblemStudy, own_problems, study_problems, study_read
from verification.complementarity.scene_cases import impacts_of_run, scene_impacts
from verification.cost.step_cost import CONTACTS, impact_cost, world_cost
from verification.finding import Failure, Table, attempt, of_each
from verification.mechanics.engine_differences import SceneDifference, scene_difference

Progress = Callable[[str, int, int], None]

SCENE_RESTITUTIONS = (None, 0.5)  # e of the scene (None), and e = 0.5, which gives more impacts, some of which differ


@dataclass(frozen=True)
class Depth:
    """The amount of computation.

    cases : impacts per cell of the map; frictional : impacts per e and μ; unequal : impacts with unequal restitution
    contacts, repeats : sizes and number of repetitions of the timings
    longest : if a solver needs more time than this [s], it skips all larger problems
    truths : names of the scenes of the convergence study, None for all
    """

    cases: int
    frictional: int
    unequal: int
    contacts: tuple[int, ...]
    repeats: int
    longest: float
    truths: tuple[str, ...] | None


QUICK_TRUTHS = ("two_discs", "bernoulli_balls", "two_link_arm_a", "peg_corner", "peg_hole", "arm_pushing",
                "ball_dropped_in_space")
DEPTHS = {
    "quick": Depth(25, 40, 100, CONTACTS, 3, 0.4, QUICK_TRUTHS),
    "full": Depth(250, 300, 1000, CONTACTS, 7, 60.0, None),
}
CONFIGURATIONS = 20  # number of configurations of each scene in which engine and references are compared
OWN = "own problems"  # name of the collection that `own_problems` makes


@dataclass(frozen=True)
class ComparisonStudy:
    """All results of `compare`.

    single : comparisons of claim C05: the family "one contact" without redundancy
    cells : the map over random families; two_contacts : agreement of the laws at two contacts, on a grid
    scenes : the map over impacts of the project's scenes; left_out : number of scene impacts that cannot be compared
    friction, unequal, bar : the engine's extensions compared with complementarity
    convergence : convergence of the rigid world to the event-driven solution, one row per scene
    impact_costs, step_costs : times for claim C22; problems : our own collection, then the folders of problem files
    piles : dense piles, resolved by (21) and by impulses that only push
    differences : differences of the engine from the references, one per scene
    failures : the cases that raised an exception; no other field contains them
    """

    depth: str
    single: tuple[Comparison, ...]
    cells: tuple[MapCell, ...]
    two_contacts: tuple[TwoContactCell, ...]
    scenes: tuple[MapCell, ...]
    left_out: int
    friction: tuple[FrictionCell, ...]
    unequal: tuple[UnequalCell, ...]
    bar: Mapping[str, float]
    convergence: tuple[ConvergenceRow, ...]
    impact_costs: Table
    step_costs: Table
    problems: tuple[ProblemStudy, ...] = ()
    piles: tuple[PileRow, ...] = ()
    differences: tuple[SceneDifference, ...] = ()
    failures: tuple[Failure, ...] = ()


def compare(
    depth: str = "quick",
    folders: Iterable[Path | str] = (),
    scenes: Iterable[str] | None = None,
    progress: Progress | None = None,
) -> ComparisonStudy:
    """Compare IAPB with complementarity: random families, scenes, extensions, cost, and folders of problem files.

    Parameters
    ----------
    depth : "quick" (a minute or two) or "full"
    folders : folders of problem files (LCP, MLCP, FCLIB)
    scenes : names of the project's scenes; default all
    progress : called as progress(stage, done, total)

    If a case raises an exception, it is in `failures` of the result.

    Raises
    ------
    ArgumentError
        An unknown depth, or a folder that does not exist.
    """
    if depth not in DEPTHS:
        raise ArgumentError("depth", depth, one_of(depth, DEPTHS))
    size, say, folders = DEPTHS[depth], progress or (lambda stage, done, total: None), tuple(folders)
    failures: list[Failure] = []
    comparisons = _random_comparisons(size.cases, say, failures)
    scene_cells, left_out = compare_scenes(scenes, say, failures)
    found = ComparisonStudy(
        depth,
        single=tuple(c for c in comparisons if c.family == "one contact" and not c.redundancy),
        cells=agreement_map(comparisons), two_contacts=two_contact_map(failures=failures),
        scenes=scene_cells, left_out=left_out,
        friction=compare_friction(size.frictional, progress=say, failures=failures),
        unequal=compare_unequal(size.unequal, failures=failures),
        bar=attempt("struck bar", struck_bar, failures) or {}, convergence=_convergence(size, say, failures),
        impact_costs=impact_cost(size.contacts, repeats=size.repeats, longest=size.longest, progress=say,
                                 failures=failures),
        step_costs=world_cost(repeats=size.repeats, progress=say, failures=failures),
        problems=(study_read(OWN, own_problems(failures), longest=size.longest, progress=say, failures=failures),
                  *(study_problems(folder, longest=size.longest, progress=say, failures=failures)
                    for folder in folders)),
        piles=compare_piles(depth, folders, failures=failures),
        differences=tuple(of_each(scene_names() if scenes is None else scenes, _difference, failures)),
    )  # fmt: skip
    return replace(found, failures=tuple(failures))


def _difference(scene: str) -> tuple[SceneDifference]:
    return (scene_difference(load_scene(find_scene(scene)), CONFIGURATIONS),)


def _convergence(size: Depth, say: Progress, failures: list[Failure]) -> tuple[ConvergenceRow, ...]:
    cases = [case for case in CASES if size.truths is None or case.scene in size.truths]
    rows = []
    for done, case in enumerate(cases, 1):
        rows.append(attempt(f"convergence on {case.scene}", partial(converge, case), failures))
        say("convergence to event-driven truth", done, len(cases))
    return tuple(row for row in rows if row is not None)


def _random_comparisons(count: int, say: Progress, failures: list[Failure]) -> tuple[Comparison, ...]:
    cases, found, piece = list(random_cases(count)), list[Comparison](), 50
    for done in range(0, len(cases), piece):
        say("random impacts", done, len(cases))
        found += compare_cases(cases[done : done + piece], failures=failures)
    say("random impacts", len(cases), len(cases))
    return tuple(found)


def compare_scenes(
    scenes: Iterable[str] | None = None, progress: Progress | None = None, failures: list[Failure] | None = None
) -> tuple[tuple[MapCell, ...], int]:
    """Compare IAPB with the LCP on the impacts of scenes; return the map and the number of impacts left out."""
    names, left_out = list(scene_names() if scenes is None else scenes), 0
    found: list[Comparison] = []
    for done, name in enumerate(names):
        for restitution in SCENE_RESTITUTIONS:
            told = name if restitution is None else f"{name}, e = {restitution:g}"
            impacts = attempt(f"impacts of {told}", partial(scene_impacts, name, restitution=restitution), failures)
            if impacts is not None:
                found += compare_cases(impacts.cases, failures=failures)
                left_out += impacts.left_out
        if progress is not None:
            progress("impacts of scenes", done + 1, len(names))
    return agreement_map(found), left_out


def compare_run(run: Run, scene: Scene) -> tuple[Comparison, ...]:
    """Compare IAPB with the Newton LCP on the impacts of one recorded run."""
    return compare_cases(impacts_of_run(run, scene).cases)
