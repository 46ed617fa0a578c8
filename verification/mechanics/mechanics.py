"""Finding on linkages and free bodies, compared with Pinocchio, closed forms and conservation laws.

Timing (`robot_timing.time_robots`) is a separate study, because its results depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from iapb.run import Run
from verification.finding import Failure, Finding, Part, Table, attempt, finding_of
from verification.mechanics import linked_impacts as linked
from verification.mechanics.coordinate_invariance import coordinate_invariance, invariance
from verification.mechanics.false_collisions import (
    filters,
    filters_table,
    study_false_collisions,
    times_table,
)
from verification.mechanics.operating import led, operating
from verification.mechanics.power_balance import definiteness, orders, positive_definite, power_balance
from verification.mechanics.robots import (
    agreement,
    compare_kinds,
    compare_robots,
    compare_scenes,
    compare_trees,
    compare_written,
    pinocchio_table,
)
from verification.mechanics.tumbling import convergence, tumbling

QUESTION = (
    "The engine describes free bodies and linkages by generalized coordinates (1)-(3). This page compares its "
    "mechanics with Pinocchio, with closed forms and with conservation laws. It then shows four applications: impacts "
    "between touching balls, the same impact in other coordinates, an arm led through its singular poses, and a ball "
    "in a faceted socket."
)
# name: study(depth, failures), which returns a Table with the outcome of every row
AGAINST_PINOCCHIO: dict[str, Callable[..., Table]] = {
    "random trees": compare_trees, "joint kinds": compare_kinds, "scenes": compare_scenes,
    "URDF texts": compare_written, "robots": compare_robots,
}  # fmt: skip
# and the function that makes a Part from the table
STUDIES: dict[str, tuple[Callable[..., Table], Callable[[Table], Part]]] = {
    "positive definite": (positive_definite, definiteness), "power balance": (power_balance, orders),
    "tumbling": (tumbling, convergence), "coordinate invariance": (coordinate_invariance, invariance),
    "operating": (operating, led),
}  # fmt: skip


def mechanics(run: Callable[..., Run], depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Run every study of the mechanics and return the Finding with one part for each.

    Parameters
    ----------
    run : (scene, world) -> Run
    """
    failures: list[Failure] = []
    studies = AGAINST_PINOCCHIO | {name: study for name, (study, _) in STUDIES.items()}
    total = len(studies) + 2
    tables: dict[str, Table] = {}
    for done, (name, study) in enumerate(studies.items(), 1):
        cases: list[Failure] = []
        table = attempt(name, partial(study, depth=depth, failures=cases), failures)
        failures += [replace(one, case=f"{name}, {one.case}") for one in cases]
        if table is not None:
            tables[name] = table
        progress(done, total)
    outcomes = linked.study_linked_impacts(failures)
    progress(total - 1, total)
    rolled = study_false_collisions(simulate=lambda scene: run(scene, "IAPB"), failures=failures)
    progress(total, total)
    compared = {name: tables.pop(name) for name in AGAINST_PINOCCHIO if name in tables}
    said = {
        **{name: partial(agreement, name, table) for name, table in compared.items()},
        **{name: partial(STUDIES[name][1], table) for name, table in tables.items()},
        "linked impacts": partial(linked.conserved, outcomes), "per-body rows": partial(linked.per_body, outcomes),
        "rows": partial(linked.rows_decide, outcomes), "false collisions": partial(filters, rolled),
    }  # fmt: skip
    parts = [attempt(f"sentence on {name}", sentence, failures) for name, sentence in said.items()]
    worst = max((row["worst"] for table in compared.values() for row in table.records()), default=0.0)
    answer = attempt("answer", lambda: (
        f"Linkages, scenes and robots differ from Pinocchio by at most {worst:.1e}. "
        f"{linked.linked_in_short(outcomes)}. The contact filter removes false collisions only if it spans a facet and "
        "the ball does not bounce."
    ), failures)  # fmt: skip
    if "operating" in tables:
        tables["operating"] = tables["operating"].without("fault")
    tables |= {"linked impacts": linked.linked_table(outcomes), "false collisions in time": times_table(rolled),
               "false collisions": filters_table(rolled), "against Pinocchio": pinocchio_table(compared)}
    return finding_of("mechanics", "Linkages and free bodies", QUESTION, answer or "", [one for one in parts if one],
                      tables, failures)  # fmt: skip
