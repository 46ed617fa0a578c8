"""The tables of the comparison with complementarity, which the report prints and plots."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from iapb.run import Run
from iapb.scene import find_scene, load_scene
from reference.complementarity.laws import LAWS
from reference.complementarity.solvers import SOLVERS
from reference.worlds import WORLDS
from verification.complementarity.convergence import COARSE, FINE
from verification.complementarity.piles import PileRow
from verification.complementarity.problems import FACTORS, ProblemStudy
from verification.complementarity.study import ComparisonStudy
from verification.finding import Failure, Table, attempt, titled

WORLD_SCENE = "peg_corner"


def all_tables(study: ComparisonStudy, failures: list[Failure] | None = None) -> dict[str, Table]:
    """Return all tables except that of the worlds, by name; `failures` receives the tables that cannot be made."""
    makers: dict[str, Callable[[], Table]] = {
        "map": partial(agreement, study), "two contacts": partial(two_contacts, study),
        "time per impact": lambda: study.impact_costs, "time per step": lambda: study.step_costs,
        "profile": partial(profile, study.problems), "convergence": partial(convergence, study),
        "friction": partial(friction, study), "unequal restitution": partial(unequal, study),
        "struck bar": partial(bar, study), "piles": partial(piles, study), "references": partial(references, study),
        "laws": laws, "solvers": solvers,
    }  # fmt: skip
    makers |= {each.folder: partial(problems, each) for each in study.problems}
    made = {name: attempt(f"table {name}", make, failures) for name, make in makers.items()}
    return {name: table for name, table in made.items() if table is not None}


def agreement(study: ComparisonStudy) -> Table:
    """Return the agreement of IAPB and the LCP, first for random families, then for scenes."""
    rows = tuple(
        (c.family, c.restitution, c.redundancy, c.cases, c.agree, c.adhesive, c.artefact, c.adhesive_share,
         _known(c.typical) if c.agree < 1.0 else None, c.farthest, max(c.extra_loss, 0.0), c.left_approaching,
         c.left_approaching_law)
        for c in study.cells + study.scenes
    )  # fmt: skip
    return titled(
        ("impacts", "e", "redundant rows", "cases", "share that agrees", "share that truly pulls",
         "share that pulls as chosen", "negative share of p", "median distance where they differ", "largest distance",
         "largest extra loss of KE⁻", "left approaching by IAPB", "left approaching by the LCP"),
        rows, 3, "IAPB and the Newton LCP; distances in the kinetic metric, relative to |v⁻|. An impact truly pulls "
        "where no p >= 0 gives its velocity; it pulls as chosen where only the least-norm p does. Left approaching: "
        "share of impacts after which some contact approaches, touching contacts without a row included.")  # fmt: skip


def two_contacts(study: ComparisonStudy) -> Table:
    """Return predicted and found agreement at two contacts, over the cosine and the speed ratio."""
    rows = tuple((c.cosine, c.speed_ratio, c.predicted, c.found, c.distance) for c in study.two_contacts)
    return titled(("cosine", "speed ratio", "agreement predicted", "agreement found", "distance"), rows, 3,
                   "Two contacts with approach speeds 1 and r, whose rows have this cosine in the kinetic metric.")


def profile(studies: Iterable[ProblemStudy]) -> Table:
    """Return the performance profiles of Dolan and Moré, one row per solver and factor."""
    rows = tuple(
        (each.folder, kind, solver, float(factor), float(share))
        for each in studies for kind, solver, shares in each.profile
        for factor, share in zip(FACTORS, shares, strict=True)
    )  # fmt: skip
    return titled(("collection", "kind", "solver", "factor", "share solved"), rows, 3, timed=("share solved",))


def problems(study: ProblemStudy) -> Table:
    """Return the verdicts, one row per problem and one column per solver."""
    names = study.solvers
    rows: list[tuple[Any, ...]] = []
    for line in study.lines:
        by = dict(line.verdicts)
        rows.append((line.problem, line.unknowns, line.rank, line.asymmetry or None,
                     *(by.get(name) for name in names), _known(line.spread), _known(line.stored), None))  # fmt: skip
    rows += [(file.file, None, None, None, *("not read" for _ in names), None, None, file.reason)
             for file in study.unread]  # fmt: skip
    return titled(
        ("problem", "unknowns", "rank", "asymmetry of W", *names, "spread of velocities", "residual as stored",
         "why not read"),
        tuple(rows), 2, "Solved: every residual, recomputed from the problem, is at most 1e-6 of the velocity scale. "
        "Spread: largest difference of contact velocities among the solvers that solved it.",
        timed=("spread of velocities",))  # fmt: skip


def convergence(study: ComparisonStudy) -> Table:
    """Return the errors of the rigid world, one row per scene and step."""
    rows = []
    for r in study.convergence:
        for rates, position, velocity in ((COARSE, r.position_coarse, r.velocity_coarse),
                                          (FINE, r.position_fine, r.velocity_fine)):  # fmt: skip
            step = len(rates) / sum(rates)
            rows.append((r.scene, r.events, 1e3 * step, position * step, velocity * step,
                         _known(r.position_order), _known(r.velocity_order)))  # fmt: skip
    return titled(
        ("scene", "events", "step [ms]", "error of positions", "error of velocities", "order, positions",
         "order, velocities"), tuple(rows), 3,
        "Each row shows the largest error of three steps near the one given; positions in the sup norm [m, rad], "
        "velocities in L¹ over time [m, rad]. A dash: the error is rounding alone.")  # fmt: skip


def friction(study: ComparisonStudy) -> Table:
    """Return the comparison with Coulomb friction, one row per e and μ."""
    rows = tuple(
        (c.restitution, c.friction, c.cases, c.pushing, c.same, c.reduced, c.unsolved, c.ncp_gains, c.ccp_gains,
         c.largest_gain, c.largest_gain_ncp, c.largest_gain_ccp, _known(c.typical_distance))
        for c in study.friction
    )  # fmt: skip
    return titled(
        ("e", "μ", "cases", "all contacts push", "share equal to the NCP", "friction reduced", "unsolved", "NCP gains",
         "CCP gains", "largest change of KE, IAPB", "NCP", "CCP", "median distance from the NCP"), rows, 2,
        "Changes of energy relative to KE⁻; positive values are gains.")  # fmt: skip


def unequal(study: ComparisonStudy) -> Table:
    """Return the comparison with unequal restitution."""
    rows = tuple((c.signs, c.cases, c.distance, c.gain, c.gain_newton_lcp, c.gain_equality) for c in study.unequal)
    return titled(("contacts", "cases", "distance from Poisson's law", "largest change of KE, IAPB", "Newton LCP",
                    "equalities"), rows, 2)  # fmt: skip


def bar(study: ComparisonStudy) -> Table:
    """Return the kinetic energy of the struck bar by law."""
    return titled(("law", "kinetic energy [J]"), tuple(study.bar.items()), 5,
                   "A bar struck at 0.5 and 0.4 of its length with e = 1 and e = 0.")  # fmt: skip


def piles(study: ComparisonStudy) -> Table:
    """Return the results on dense piles, one row per kind of pile and choice of rows."""
    groups: dict[tuple[str, str], list[PileRow]] = {}
    for row in study.piles:
        groups.setdefault((row.name, row.rows), []).append(row)
    rows = tuple(
        (name, given, len(found), float(np.mean([row.contacts for row in found])),
         float(np.mean([row.redundant for row in found])), float(np.mean([row.agrees for row in found])),
         max((row.contacts for row in found if row.agrees), default=0),
         float(np.mean([row.pulling for row in found])), float(np.mean([row.pulling_share for row in found])),
         float(np.median([row.distance for row in found])), max(row.lcp for row in found),
         1e6 * float(np.median([row.equality for row in found])),
         1e6 * float(np.median([row.pushing for row in found])))
        for (name, given), found in groups.items()
    )  # fmt: skip
    times = ("time of (21) [µs]", "time of pushing [µs]")
    return titled(
        ("pile", "rows", "piles", "contacts", "redundant", "share that agrees", "most contacts that agree",
         "share of impulses that pull", "negative share of p", "median distance from the LCP", "pushing from the LCP",
         *times), rows, 3,
        "(21) with every row as an equality, beside impulses that only push (method \"poisson\"); e = 0; distances in "
        "the kinetic metric, relative to |v⁻|. Agrees: some p >= 0 gives the velocity of (21). Times are of calls from "
        "Python, checks included.",
        timed=times)  # fmt: skip


def references(study: ComparisonStudy) -> Table:
    """Return the differences of the engine from the references in mechanics and contacts, one row per scene."""
    rows = tuple((d.scene, d.configurations, d.apart, d.mass_matrix, d.inner_forces, d.frame_jacobian, d.contacts,
                  d.gap, d.normal, d.row) for d in study.differences)  # fmt: skip
    return titled(("scene", "configurations", "with other contacts", "M", "B + G", "frame Jacobians", "contacts",
                   "gap [m]", "normal", "contact row"), rows, 2, "Largest differences between engine and reference: "
                  "relative to the largest entry for M, B + G and Jacobians, absolute for contacts.")  # fmt: skip


def laws() -> Table:
    """Return the impact laws with statement, source and hypotheses."""
    rows = tuple((law.name, law.statement, law.source, law.hypotheses, law.never_gains_energy) for law in LAWS.values())
    return titled(("law", "statement", "source", "hypotheses", "never gains energy under them"), rows)


def solvers() -> Table:
    """Return the solvers with method, package and kind of problem."""
    takes = {"lcp": "no friction", "convex": "no friction, W symmetric semidefinite", "cone": "friction"}
    rows = tuple((name, entry.method, entry.package, takes[entry.takes]) for name, entry in SOLVERS.items())
    note = ("Siconos is a system package and is called through the system's Python. Its time is that of its compiled "
            "solve; the times of all others are of a call from Python.")  # fmt: skip
    return titled(("solver", "method", "package", "takes"), rows, note=note)


def worlds(
    run: Callable[..., Run], values: dict[str, Any] | None = None, failures: list[Failure] | None = None
) -> Table:
    """Return the contact law and coupling of every world, read from one run each; `values` change the scene."""
    scene = load_scene(find_scene(WORLD_SCENE)).with_values(values or {})
    rows = []
    for world in WORLDS:
        done = attempt(f"world {world}", partial(run, scene, world, keep=False), failures)
        if done is not None:
            rows.append((world, done.law, _settings(done.law_settings), done.coupling,
                         _settings(done.coupling_settings)))  # fmt: skip
    return titled(("world", "contact law", "its settings", "coupling", "its gains"), tuple(rows), 4,
                   f"From the run file of {WORLD_SCENE} in each world.")  # fmt: skip


def _settings(values: Any) -> str:
    texts = (f"{name} {json.dumps(value, ensure_ascii=False)}" for name, value in dict(values).items())
    return ", ".join(texts) or "none"


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
