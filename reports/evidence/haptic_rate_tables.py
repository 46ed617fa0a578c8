"""The tables of "The haptic rate"."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from verification.finding import Failure, Table, attempt, titled

QUARTILES = ("time [µs]", "lower quartile [µs]", "upper quartile [µs]")


def all_tables(study: Any, failures: list[Failure] | None = None) -> dict[str, Table]:
    """By name; `failures` receives those that cannot be made."""
    makers = {
        "steps against MuJoCo": races, "parts of a step": parts, "scaling": scaling, "fitted": fitted,
        "contacts at 1 kHz": rate, "bodies": bodies, "robots": robots, "solvers": solvers, "start": start,
        "budgets": budgets, "motions": motions,
    }  # fmt: skip
    made = {name: attempt(f"table {name}", partial(make, study), failures) for name, make in makers.items()}
    return {name: table for name, table in made.items() if table is not None}


def races(study: Any) -> Table:
    """A row per scene, form and solver."""
    rows = tuple(
        (r.scene, r.form, r.solver, r.contacts, r.their_contacts, r.ours.median * 1e6, r.theirs.median * 1e6,
         r.ratio.median, f"{r.ratio.lower:.2g} to {r.ratio.upper:.2g}", r.target, r.moved, r.they_moved)
        for r in study.races
    )  # fmt: skip
    return titled(("scene", "MuJoCo's form", "MuJoCo's solver", "our contacts", "its contacts", "our step [µs]",
                    "its step [µs]", "ratio", "quartiles", "asked for", "we moved", "it moved"), rows, 3,
                   "Frictionless (condim 1), same masses, forces and step; MuJoCo's other options are its defaults. "
                   "Ours is recorded, MuJoCo's is not. Moved: largest change of a coordinate while timed, m or rad.",
                   timed=("our step [µs]", "its step [µs]", "ratio", "quartiles", "we moved", "it moved"))  # fmt: skip


def parts(study: Any) -> Table:
    """A row per scene and part."""
    rows = tuple((p.scene, p.part, *(1e6 * t for t in (p.seconds.median, p.seconds.lower, p.seconds.upper)))
                 for p in study.parts)  # fmt: skip
    return titled(("scene", "part", *QUARTILES), rows, 3, "Each part repeated by itself in compiled code.",
                   timed=QUARTILES)


def scaling(study: Any) -> Table:
    """A row per method and size."""
    rows = tuple((t.method, t.coordinates, t.contacts, t.seconds.median * 1e6, t.seconds.lower * 1e6,
                  t.seconds.upper * 1e6) for t in study.scaling)  # fmt: skip
    return titled(("method", "coordinates", "contacts", *QUARTILES), rows, 3, "Rows of rank two thirds of d.",
                   timed=QUARTILES)


def fitted(study: Any) -> Table:
    """A row per method and axis."""
    from verification.cost.scaling import exponent

    rows = tuple((method, axis, exponent(study.scaling, method, axis))
                 for method in ("factored", "gram_pinv") for axis in ("contacts", "coordinates"))  # fmt: skip
    return titled(("method", "axis", "exponent"), rows, 3, "Least squares of log time over log size.",
                   timed=("exponent",))


def rate(study: Any) -> Table:
    """C19: a row per number of coordinates."""
    from verification.cost.haptic_rate import FACTORED, PRINTED, most_contacts

    sizes = dict.fromkeys(trial.coordinates for trial in study.trials)
    rows = tuple((d, *(most_contacts(study.trials, method, d) for method in (FACTORED, PRINTED))) for d in sizes)
    found = ("most contacts, factored", "most contacts, printed formula")
    return titled(("coordinates", *found), rows, 6,
                   "Largest size tried of which 999 of 1000 impacts end within 1 ms, on this machine.", timed=found)


def bodies(study: Any) -> Table:
    """A row per number of bodies."""
    rows = tuple((b.bodies, b.seconds * 1e6, b.contacts, b.pairs, b.tested) for b in study.bodies)
    return titled(("bodies", "step [µs]", "contacts", "pairs of shapes", "pairs tested"), rows, 3,
                   timed=("step [µs]",))


def robots(study: Any) -> Table:
    """A row per robot, quantity and form."""
    names = ("robot", "velocities", "quantity", "form", "time", "Pinocchio", "ratio", "lower quartile",
             "upper quartile")  # fmt: skip
    heads = tuple({"time": "ours [µs]", "Pinocchio": "Pinocchio [µs]"}.get(name, name) for name in names)
    return titled(heads, tuple(tuple(row[name] for name in names) for row in study.robots), 3, study.robots_of,
                   timed=heads[4:])


def solvers(study: Any) -> Table:
    """A row per solver and size."""
    rows = tuple((r.family, r.contacts, r.solver, r.verdict, _known(r.median * 1e6), _known(r.least * 1e6),
                  _known(r.largest * 1e6), _known(r.distance)) for r in study.solvers)  # fmt: skip
    return titled(("impacts", "contacts", "solver", "outcome", "median [µs]", "least [µs]", "largest [µs]",
                    "distance of v⁺"), rows, 3,
                   "From M, J, v to v⁺; kernels compiled, all others from Python.",
                   timed=("median [µs]", "least [µs]", "largest [µs]"))  # fmt: skip


def start(study: Any) -> Table:
    """A row per process."""
    rows = tuple((s.what, s.wall, s.cpu, s.runs, s.limit) for s in study.start_up)
    return titled(("what", "on the wall [s]", "computing [s]", "processes", "asked for [s]"), rows, 3,
                   timed=("on the wall [s]", "computing [s]"))


def budgets(study: Any) -> Table:
    """A row per size and budget."""
    rows = tuple((b.coordinates, b.contacts, b.rank, b.budget, b.unmet, b.worst, b.lost, b.most_gain)
                 for b in study.budgets)  # fmt: skip
    return titled(("coordinates", "contacts", "rank", "budget [rows]", "median residual", "largest residual",
                    "share of the loss", "largest relative gain"), rows, 3,
                   "Residual: max |J v⁺ + e J v⁻| in the kinetic metric, of |v⁻|.")  # fmt: skip


def motions(study: Any) -> Table:
    """A row per scene, method and step."""
    rows = tuple((r.scene, r.method, r.step * 1e3, _known(r.seconds * 1e3), _known(r.position), _known(r.velocity),
                  _known(abs(r.energy)), _known(r.energy), r.status, r.note) for r in study.trajectories)  # fmt: skip
    return titled(("scene", "method", "step [ms]", "time [ms]", "position", "velocity", "energy",
                    "signed energy", "outcome", "note"), rows, 3,
                   "Position in lengths of the body (sup norm), velocity in largest speeds (L¹, at samples a "
                   "millisecond apart), energy at the end in largest kinetic energies.",
                   timed=("time [ms]", "outcome", "note"))  # fmt: skip


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
