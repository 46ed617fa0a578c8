"""What the topic "mechanics" found, in sentences made from the records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from reports.evidence.mechanics_tables import AGAINST_PINOCCHIO
from verification.cost.many_bodies import StepCost, growth_exponent
from verification.finding import LIMITED, NOT_COMPUTED, REFUTED, REPRODUCED, Part, Table
from verification.mechanics.false_collisions import EDGE_JUMP, FalseCollisions
from verification.mechanics.linked_impacts import (
    ALL,
    APPROACHING,
    CONSERVED,
    PER_BODY,
    RELATIVE,
    LinkedOutcome,
)

Studies = Mapping[str, Table]
# Slope of the pairs tested over the bodies: 1 is linear, all pairs have 2.
LINEAR = 1.2

_AGREE = {
    "random trees": "trees of 1 to 30 bodies, every joint kind and nearly singular inertias among them",
    "joint kinds": "trees that have one kind of joint only",
    "scenes": "mechanisms of the scenes that come along",
    "URDF texts": "sets of URDF texts, our own robot and random ones with every joint type, each read by two parsers",
    "robots": "robots of the folder beside the checkout, with a fixed and a floating base",
}


def _outcome(passed: bool | None) -> str:
    return NOT_COMPUTED if passed is None else REPRODUCED if passed else REFUTED


def against_pinocchio(name: str, study: Table) -> Iterator[Part]:
    """The sentence on one set of mechanisms."""
    from verification.mechanics.robots import AGREEMENT, QUANTITIES

    if not study.rows:
        yield Part(f"Robots beside the checkout: not there ({study.note}), so not compared.", NOT_COMPUTED)
        return
    rows = study.records()
    states = sum(row["states"] for row in rows)
    quantity = max(QUANTITIES, key=lambda q: max(row[q] for row in rows)).replace("_", " ")
    yield Part(
        f"{_count(name, rows)} {_AGREE[name]}: at {states:,} random states everything differs from Pinocchio "
        f"by at most {max(row['worst'] for row in rows):.1e} of the largest entry (tolerance {AGREEMENT:g}), the "
        f"{quantity} most.", _outcome(study.passed),
    )  # fmt: skip


def _count(name: str, rows: Sequence[Mapping[str, Any]]) -> int:
    from verification.mechanics.robots import STATES

    if name == "random trees":
        return sum(row["states"] for row in rows) // STATES
    return len({row["mechanism"] for row in rows})


def positive_definite(study: Table) -> Iterator[Part]:
    """How many matrices, and how near to zero."""
    rows = study.records()
    judged = sum(row["judged, condition ≤ 1e12"] for row in rows)
    least = min(row["least eigenvalue × condition"] for row in rows)
    yield Part(
        f"All {judged} of {sum(row['mass matrices'] for row in rows)} random mass matrices whose scaled condition is "
        f"at most 1e12 (up to {max(row['largest condition judged'] for row in rows):.1e}) are positive definite: the "
        f"least eigenvalue times the condition is never below {least:.2g}."
        if study.passed else "A random mass matrix of moderate condition is not positive definite.",
        _outcome(study.passed),
    )  # fmt: skip


def power_balance(study: Table) -> Iterator[Part]:
    """The orders found for each integrator."""
    found = "; ".join(
        f"{_plain(name)} {_span([row['median order'] for row in rows])} (declared {rows[0]['declared order']})"
        for name, rows in _by(study.records(), "integrator").items()
    )
    yield Part(
        f"On random trees of 1 to 30 joints the energy changes by the work of the forces with the integrator's order: "
        f"{found}.", _outcome(study.passed))  # fmt: skip


def tumbling(study: Table) -> Iterator[Part]:
    """The orders found for each integrator and form."""
    series = []
    for (name, form), rows in _by(_judged(study), "integrator", "form").items():
        orders = _span([row["order"] for row in rows])
        series.append(f"{_plain(name)}, {form}: {orders} (declared {rows[0]['declared order']})")
    yield Part(
        "A free tumbling body converges to the closed form with the declared order, and its energy and angular "
        f"momentum converge no slower: {'; '.join(series)}.", _outcome(study.passed))  # fmt: skip


def coordinate_invariance(study: Table) -> Iterator[Part]:
    """Where the conditions are moderate, and where only the bound holds."""
    from verification.mechanics.coordinate_invariance import AGREEMENT

    rows = [(row, held) for row, held in zip(study.records(), study.holds, strict=True)]
    moderate = [row for row, _ in rows if row["tolerance"] == AGREEMENT]
    beyond = [row for row, held in rows if held is not None and row["tolerance"] != AGREEMENT]
    silent = sum(held is None for _, held in rows)
    yield Part(
        f"C06: the same impact in two parametrizations agrees to {max(row['error'] for row in moderate):.1e} in the "
        f"{len(moderate)} cases of moderate condition (tolerance {AGREEMENT:g}); in {len(beyond)} worse ones, up to "
        f"the singular pose, the error is at most {max(row['error'] / row['bound'] for row in beyond):.1e} of its "
        f"bound C ε κ/σ_min. In {silent} the bound exceeds 1 and says nothing.", _outcome(study.passed))  # fmt: skip


def operating(study: Table) -> Iterator[Part]:
    """How near to singular, how fast, and how well the balance closes."""
    rows = study.records()
    near = sum(row["steps near singular"] or 0 for row in rows)
    faults = sum(bool(row["fault"]) for row in rows)
    share = max(abs(row["residual"]) / row["tolerance"] for row in rows if not row["fault"])
    yield Part(
        f"Led by any link and point along {len(rows)} ways through its singular poses ({near:,} steps within a degree "
        f"or so of straight or folded), the simulation breaks off in {faults}; no joint turns faster than "
        f"{max(row['largest joint speed'] for row in rows if not row['fault']):.3g} rad/s, and the energy balance is "
        f"open by at most {share:.2g} of what a first-order step may make up.", _outcome(study.passed))  # fmt: skip


def linked(outcomes: Sequence[LinkedOutcome]) -> Iterator[Part]:
    """What is conserved, what is not, and what the rows decide."""
    kept = [o for o in outcomes if o.treatment != PER_BODY]
    lost = [o for o in outcomes if o.treatment == PER_BODY]
    energy, momentum = _changes(kept)
    problems = len({o.problem for o in outcomes})
    yield Part(
        f"Cradles of 2 to 7 balls and Bernoulli's problem ({problems}): with relative rows (12), and event by event, "
        f"energy and momentum change by at most {energy:.1e} and {momentum:.1e} (tolerance {CONSERVED:g}).",
        REPRODUCED if max(energy, momentum) <= CONSERVED else REFUTED)  # fmt: skip
    energy, least = _changes(lost)[0], min(o.momentum_change for o in lost)
    yield Part(
        f"With the per-body rows of (13)-(14) energy changes by at most {energy:.1e}, but in all {len(lost)} cases "
        f"momentum changes by {least:.2g} times what there was or more: the striker comes back as from a wall "
        "(erratum 3).", REPRODUCED if energy <= CONSERVED < least else REFUTED)  # fmt: skip


def _changes(outcomes: Sequence[LinkedOutcome]) -> tuple[float, float]:
    return max(abs(o.energy_change) for o in outcomes), max(o.momentum_change for o in outcomes)


def rows_decide(outcomes: Sequence[LinkedOutcome]) -> Iterator[Part]:
    """The cradle of five by three choices of rows that all conserve everything."""
    five = {(o.treatment, o.rows): o.velocity[:, 0] for o in outcomes if o.problem == "cradle of 5"}
    found = {"all touching rows": five[RELATIVE, ALL], "the approaching row": five[RELATIVE, APPROACHING],
             "one after the other": next(v for (_, rows), v in five.items() if "one after" in rows)}  # fmt: skip
    words = "; ".join(f"{name} ({', '.join(f'{v + 0.0:.1f}' for v in values)})" for name, values in found.items())
    apart = min(float(np.abs(a - b).max()) for a, b in _pairs(list(found.values())))
    yield Part(
        f"Conservation does not decide the outcome, the rows do. Cradle of five, velocities after: {words} m/s. The "
        "paper takes the rows that approach; only the sequence hands the blow to the last ball.",
        REPRODUCED if apart > CONSERVED else REFUTED)  # fmt: skip


def _pairs(values: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    return ((a, b) for k, a in enumerate(values) for b in values[k + 1 :])


def false_collisions(found: Sequence[FalseCollisions]) -> Iterator[Part]:
    """C18 at the scene's own distances: with both filters, then each alone."""
    of: dict[str, dict[float, FalseCollisions]] = {}
    for run in found:
        of.setdefault(run.setting, {})[run.damping] = run
    counts = "; ".join(f"{name} {', '.join(str(run.collisions) for run in runs.values())}" for name, runs in of.items())
    both, none = of["both filters"], of["no filter"]
    left = {damping: run for damping, run in both.items() if run.collisions}
    bounce = "".join(f" At {damping:g} N s/m the ball leaves the facets ({run.lifted} steps off them) and comes back "
                     "as a new contact." for damping, run in left.items() if run.lifted)  # fmt: skip
    lost = max(run.energy_lost / run.potential_drop for run in none.values())
    yield Part(
        f"C18: a ball that rolls in the faceted socket, at damping {', '.join(f'{b:g}' for b in both)} N s/m and with "
        f"distances beyond the {1e3 * EDGE_JUMP:.1f} mm of an edge, collides falsely: {counts}. Without filters up to "
        f"{lost:.0%} of the fall's energy goes with them. Coherence removes them, clustering the doubled contacts "
        f"({sum(run.doubled for run in none.values())} without filters, "
        f"{sum(run.doubled for run in both.values())} with both).{bounce}",
        REFUTED if len(left) == len(both) else LIMITED if left else REPRODUCED)  # fmt: skip


def many_bodies(costs: Sequence[StepCost]) -> Iterator[Part]:
    """The slope of the pairs tested, and the time of a step."""
    slope, last, first = growth_exponent(costs, "tested"), costs[-1], min(costs, key=lambda c: abs(c.bodies - 20))
    yield Part(
        f"With the broad phase the pairs tested grow as bodies to the power {slope:.2f}: {last.tested:.0f} of "
        f"{last.pairs:,} for {last.bodies} free bodies.", REPRODUCED if slope <= LINEAR else REFUTED)  # fmt: skip
    yield Part(
        f"A step took {1e6 * first.seconds:.3g} µs with {first.bodies} free bodies and {1e6 * last.seconds:.3g} µs "
        f"with {last.bodies} here (exponent {growth_exponent(costs):.2f}).", REPRODUCED, timed=True)  # fmt: skip


# What is said of each study by itself.
OF_STUDIES = {
    "positive definite": positive_definite, "power balance": power_balance, "tumbling": tumbling,
    "coordinate invariance": coordinate_invariance, "operating": operating,
}  # fmt: skip


def verdict(studies: Studies, outcomes: Sequence[LinkedOutcome]) -> str:
    """The sentence of the first page."""
    compared = [studies[name] for name in AGAINST_PINOCCHIO if name in studies]
    worst = max(row["worst"] for study in compared for row in study.records())
    energy, momentum = _changes([o for o in outcomes if o.treatment != PER_BODY])
    least = min(o.momentum_change for o in outcomes if o.treatment == PER_BODY)
    return (f"Trees, scenes and robots differ from Pinocchio by at most {worst:.1e}; linked impacts keep energy and "
            f"momentum to {max(energy, momentum):.1e} with relative rows, while the paper's per-body rows change the "
            f"momentum by {least:.2g} of itself; false collisions go where coherence reaches the next facet and the "
            "ball does not bounce.")  # fmt: skip


def _judged(study: Table) -> list[dict[str, Any]]:
    """The rows that decide."""
    return [row for row, held in zip(study.records(), study.holds, strict=True) if held is not None]


def _by(rows: Sequence[dict[str, Any]], *names: str) -> dict[Any, list[dict[str, Any]]]:
    """Rows by the values of some columns."""
    found: dict[Any, list[dict[str, Any]]] = {}
    for row in rows:
        key = row[names[0]] if len(names) == 1 else tuple(row[name] for name in names)
        found.setdefault(key, []).append(row)
    return found


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"


def _plain(name: str) -> str:
    """An integrator's name for people."""
    return {"semi_implicit_euler": "semi-implicit Euler", "runge_kutta_4": "Runge-Kutta 4"}.get(name, name)
