"""A free body tumbles: each integrator against the closed form, its drifts, and its order measured.

Two forms of each integrator: `Integrator.step`, which keeps its `order` on rotations, and the compiled step of the
simulation, which combines its stages in one displacement and declares a `group_order`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.mechanics.integrators import INTEGRATORS, Integrator
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from verification.claims.table import Column, Table, table_of
from verification.mechanics.record import Finding, check_depth
from verification.mechanics.torque_free import TorqueFreeBody

Floats = NDArray[np.float64]

MASS = 0.3  # [kg]
DRIFT = (0.2, -0.1, 0.3)  # velocity of the centre of mass [m/s]
DURATION = 2.0  # [s], about one period
# A gentle wobble; and close to the unstable middle axis, where the body turns over again and again.
MOTIONS = {
    "wobbling": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 1.0, 3.0),
    "turning over": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 4.0, 2.8),
}
COARSEST = {
    "semi_implicit_euler": 800,
    "midpoint": 200,
    "runge_kutta_4": 100,
}  # steps: small enough to show the order
HALVINGS = {"quick": 2, "full": 5}
ORDER_TOLERANCE = 0.15  # what the next error term adds at these steps
ROUNDING = 1e-10  # errors below this feel the rounding of some thousand steps (1e-12): no order shows there

COLUMNS = (
    Column("motion", condition=True),
    Column("integrator", condition=True),
    Column("form", condition=True),
    Column("step", "s", condition=True),
    Column("attitude error", "rad"),
    Column("rate error", "rad/s"),
    Column("place error", "m"),
    Column("energy drift", "relative"),
    Column("momentum drift", "relative"),
    Column("order"),
    Column("declared order"),
)
PYTHON, COMPILED = "Integrator.step", "compiled step"


class Tumble(NamedTuple):
    """Attitude (3, 3), rate (3,) [rad/s] in body axes, place (3,) [m] and velocity (3,) [m/s] in body axes."""

    axes: Floats
    rate: Floats
    place: Floats
    velocity: Floats


def tumbling(depth: str = "quick") -> Finding:
    """Measure every integrator in both forms on both motions, over a row of halved steps."""
    check_depth(depth)
    rows = []
    for motion, body in MOTIONS.items():
        for method in INTEGRATORS.values():
            for form, end, order in _forms(method):
                head = {"motion": motion, "integrator": method.name, "form": form, "declared order": order}
                rows += [head | row for row in _halved(body, method, end, HALVINGS[depth])]
    statement = "Attitude and rate converge to the closed form with the order that the integrator declares."
    tolerance = f"order within {ORDER_TOLERANCE} of the declared one, by the two finest steps above rounding"
    return Finding("Free tumbling body", statement, tolerance, judged(table_of(COLUMNS, rows)))


def _forms(method: Integrator) -> tuple[tuple[str, Callable[..., Tumble], int], ...]:
    return (PYTHON, end_by_python, method.order), (COMPILED, end_compiled, method.group_order)


def exact(body: TorqueFreeBody, time: float) -> Tumble:
    """The closed form; the world's axes are the body's at the start, and the centre of mass starts at the origin."""
    axes = body.axes(0.0).T @ body.axes(time)
    drift = np.array(DRIFT)
    return Tumble(axes, body.rates(time), drift * time, axes.T @ drift)


def mechanism_of(body: TorqueFreeBody) -> Mechanism:
    """The body on a free flyer."""
    return Mechanism([Body("body", None, Joint("free_flyer"), mass=MASS, inertia=np.diag(body.moments))])


def end_by_python(body: TorqueFreeBody, method: Integrator, steps: int) -> Tumble:
    """The state after DURATION by `Integrator.step`."""
    mechanism = mechanism_of(body)

    def acceleration(q: Floats, v: Floats) -> Floats:
        return np.array(np.linalg.solve(mechanism.mass_matrix(q), -mechanism.bias(q, v)), np.float64)

    q, v = mechanism.neutral(), np.concatenate([DRIFT, body.rates(0.0)])
    for _ in range(steps):
        q, v = method.step(mechanism.integrate, acceleration, q, v, DURATION / steps)
    return _tumble(mechanism, q, v)


def end_compiled(body: TorqueFreeBody, method: Integrator, steps: int) -> Tumble:
    """The state after DURATION by the simulation."""
    from iapb.contact.laws import Penalty
    from iapb.simulation import simulate

    start = [float(x) for x in (*DRIFT, *body.rates(0.0))]
    values = {"rate": steps / DURATION, "duration": DURATION, "bodies.tennis_racket.mass": MASS,
              "bodies.tennis_racket.inertia": list(body.moments), "bodies.tennis_racket.velocity": start}  # fmt: skip
    run = simulate(_scene().with_values(values), Penalty(integrator=method.name), steps=steps)
    return _tumble(mechanism_of(body), run.q[-1], run.v[-1])


@cache
def _scene() -> Any:
    from iapb.scene import load_scene
    from iapb.scene_files import find_scene

    return load_scene(find_scene("tumbling_body"))


def _tumble(mechanism: Mechanism, q: Floats, v: Floats) -> Tumble:
    rotations, positions = mechanism.placements(q)
    return Tumble(rotations[0], v[3:], positions[0], v[:3])


def _halved(
    body: TorqueFreeBody, method: Integrator, end: Callable[..., Tumble], halvings: int
) -> Iterator[dict[str, Any]]:
    """Yield errors, drifts and order for each step length."""
    truth, before = exact(body, DURATION), None
    for k in range(halvings):
        steps = COARSEST[method.name] << k
        row = {"step": DURATION / steps, **errors(end(body, method, steps), truth, body)}
        total = float(np.hypot(row["attitude error"], row["rate error"] / body.third_rate))
        if before is not None and total > ROUNDING:
            row["order"] = float(np.log2(before / total))
        before = total
        yield row


def errors(found: Tumble, truth: Tumble, body: TorqueFreeBody) -> dict[str, float]:
    """Return the errors against the closed form, and the drifts of energy and angular momentum."""
    moments = np.array(body.moments)
    energy = 0.5 * (moments @ found.rate**2 + MASS * found.velocity @ found.velocity)
    at_start = body.energy + 0.5 * MASS * float(np.dot(DRIFT, DRIFT))
    spin, spin_at_start = found.axes @ (moments * found.rate), moments * body.rates(0.0)
    return {
        "attitude error": float(np.linalg.norm(found.axes - truth.axes)) / np.sqrt(2.0),  # of small angles
        "rate error": float(np.linalg.norm(found.rate - truth.rate)),
        "place error": float(np.linalg.norm(found.place - truth.place)),
        "energy drift": float(energy / at_start - 1.0),
        "momentum drift": float(np.linalg.norm(spin - spin_at_start)) / body.momentum,
    }


def judged(table: Table) -> Table:
    """The last order that shows in each series is the one that must be the declared one."""
    records = table.records()
    series = [(row["motion"], row["integrator"], row["form"]) for row in records]
    last = {
        key: k for k, (key, row) in enumerate(zip(series, records, strict=True)) if row["order"] is not None
    }
    holds = [
        bool(abs(row["order"] - row["declared order"]) <= ORDER_TOLERANCE) if last.get(key) == k else None
        for k, (key, row) in enumerate(zip(series, records, strict=True))
    ]
    return replace(table, holds=tuple(holds))
