"""The tables of the topic "mechanics": what its studies measured, in the columns that a reader needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from verification.cost.many_bodies import StepCost
from verification.finding import WORDS, Table, titled
from verification.mechanics.false_collisions import FalseCollisions
from verification.mechanics.linked_impacts import LinkedOutcome
from verification.mechanics.robots import TOLERANCE

# Studies that compare with Pinocchio, and what their rows are called together.
AGAINST_PINOCCHIO = {
    "random trees": "random trees", "joint kinds": "joint kinds", "scenes": "scenes", "URDF texts": "URDF texts",
    "robots": "robots beside the checkout",
}  # fmt: skip
_ENERGIES = ("kinetic_energy", "potential_energy")
_KINEMATICS = ("placement", "frame_jacobian", "point_jacobian")


def study_table(study: Table, leave_out: Sequence[str] = ()) -> Table:
    """Return the trials of a study with their outcomes."""
    return study.without(*leave_out)


def pinocchio_table(studies: Mapping[str, Table]) -> Table:
    """Return one row per mechanism: the largest relative difference of each quantity from Pinocchio's."""
    rows = tuple(
        (words, *_differences(row), WORDS[held])
        for name, words in AGAINST_PINOCCHIO.items()
        if name in studies
        for row, held in zip(studies[name].records(), studies[name].holds, strict=True)
    )
    columns = ("set", "mechanism", "base", "velocities", "states", "mass matrix", "placements and Jacobians", "bias",
               "gravity", "inverse dynamics", "energies", "momentum", "worst", "holds")  # fmt: skip
    note = f"Largest difference over all states. Tolerance: {TOLERANCE}."
    return titled(columns, rows, digits=2, note=note)


def _differences(row: Mapping[str, Any]) -> tuple[Any, ...]:
    return (row["mechanism"], row["base"], row["velocities"], row["states"], row["mass_matrix"],
            max(row[name] for name in _KINEMATICS), row["bias"], row["gravity"], row["inverse_dynamics"],
            max(row[name] for name in _ENERGIES), row["momentum"], row["worst"])  # fmt: skip


def linked_table(outcomes: Sequence[LinkedOutcome]) -> Table:
    """Return one row per ball of each outcome."""
    columns = ("problem", "treatment", "rows or order", "ball", "v_x before [m/s]", "v_x after [m/s]",
               "v_y after [m/s]", "energy change", "momentum change")  # fmt: skip
    rows = tuple(
        (o.problem, o.treatment, o.rows, ball, float(o.before[ball, 0]), float(after[0]), float(after[1]),
         o.energy_change, o.momentum_change)
        for o in outcomes for ball, after in enumerate(o.velocity)
    )  # fmt: skip
    note = "Elastic impacts of equal frictionless balls; changes are relative to what there was before."
    return titled(columns, rows, note=note)


def filters_table(found: Sequence[FalseCollisions]) -> Table:
    """Return one row per run of the socket."""
    columns = ("filters", "damping [N s/m]", "false collisions", "contacts taken as new", "doubled contacts",
               "steps off the facets", "energy lost [J]", "lost, of the fall")  # fmt: skip
    rows = tuple((f.setting, f.damping, f.collisions, f.new_contacts, f.doubled, f.lifted, f.energy_lost,
                  f.energy_lost / f.potential_drop) for f in found)  # fmt: skip
    return titled(columns, rows, digits=3, note="The ball rolls for two seconds; one contact per step is right.")


def times_table(found: Sequence[FalseCollisions]) -> Table:
    """Return one row per false collision, in time."""
    rows = tuple(
        (f.setting, f.damping, time, count, sum(f.losses[:count]) / f.potential_drop)
        for f in found for count, time in enumerate(f.times, start=1)
    )  # fmt: skip
    columns = ("filters", "damping [N s/m]", "time [s]", "false collisions so far", "lost so far, of the fall")
    return titled(columns, rows)


def bodies_table(costs: Sequence[StepCost]) -> Table:
    """Return one row per number of bodies."""
    columns = ("free bodies", "pairs that could touch", "pairs tested per step", "contacts per step",
               "impacts in 500 steps", "time per step [µs]")  # fmt: skip
    rows = tuple((c.bodies, c.pairs, c.tested, c.contacts, c.impacts, 1e6 * c.seconds) for c in costs)
    return titled(columns, rows, digits=3, timed=columns[-1:],
                   note="Times are those of the machine that made this report.")
