"""Tumbling of a free body: errors of each integrator against the closed form, its drifts, and its measured order.

The study covers every integrator of the compiled simulation, and the fourth-order method that exists only in Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.contact.laws import Penalty
from iapb.mechanics.integrators import INTEGRATORS, Integrator
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from verification.check import Check, Study
from verification.mechanics.commutator_free import COMMUTATOR_FREE_4
from verification.mechanics.power_balance import by, span, words
from verification.mechanics.torque_free import TorqueFreeBody
from verification.table import Table

Floats = NDArray[np.float64]

MASS = 0.3  # [kg]
DRIFT = (0.2, -0.1, 0.3)  # velocity of the centre of mass [m/s]
DURATION = 2.0  # [s], about one period
# A gentle wobble, and a rotation close to the unstable middle axis, in which the body flips periodically.
MOTIONS = {
    "wobbling": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 1.0, 3.0),
    "turning over": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 4.0, 2.8),
}
COARSEST = {
    "momentum": 200,
    "semi_implicit_euler": 800,
    "midpoint": 200,
    "runge_kutta_4": 100,
    "commutator_free_4": 100,
}  # steps: small enough to show the order
HALVINGS = {"quick": 4, "full": 6}
ORDER_TOLERANCE = 0.15  # size of the next error term at these steps
ROUNDING = 1e-10  # smaller errors contain the rounding of some thousand steps (1e-12) and show no order

DRIFT_ORDERS = ("energy order", "momentum order")
ORDERS = ("order", *DRIFT_ORDERS)


class Tumble(NamedTuple):
    """Attitude (3, 3), rate (3,) [rad/s] in body axes, position (3,) [m] and velocity (3,) [m/s] in body axes.

    For a path of n states, each array has n as its first dimension.
    """

    axes: Floats
    rate: Floats
    place: Floats
    velocity: Floats


METHODS = {method.name: method for method in (*INTEGRATORS.values(), COMMUTATOR_FREE_4)}


def _rows(study: Study, case: tuple[str, str]) -> list[dict[str, Any]]:
    """Return the rows of one motion by one integrator, with repeatedly halved steps."""
    (motion, name), method = case, METHODS[case[1]]
    path = path_by_python if method is COMMUTATOR_FREE_4 else path_compiled
    head = {"motion": motion, "integrator": name}
    halved = _halved(MOTIONS[motion], method, path, HALVINGS[study.depth])
    return judged([head | row | {"declared order": method.group_order} for row in halved])


def exact(body: TorqueFreeBody, time: float) -> Tumble:
    """Return the closed-form state; at time 0 the world frame is the body frame at the centre of mass."""
    axes = body.axes(0.0).T @ body.axes(time)
    drift = np.array(DRIFT)
    return Tumble(axes, body.rates(time), drift * time, axes.T @ drift)


def mechanism_of(body: TorqueFreeBody) -> Mechanism:
    """Return the mechanism of the body with a free-flyer joint."""
    return Mechanism([Body("body", None, Joint("free_flyer"), mass=MASS, inertia=np.diag(body.moments))])


def path_by_python(body: TorqueFreeBody, method: Integrator, steps: int) -> Tumble:
    """Return the states over DURATION, computed by `Integrator.step`."""
    mechanism = mechanism_of(body)

    def acceleration(q: Floats, v: Floats) -> Floats:
        return np.array(np.linalg.solve(mechanism.mass_matrix(q), -mechanism.bias(q, v)), np.float64)

    path = [(mechanism.neutral(), np.concatenate([DRIFT, body.rates(0.0)]))]
    for _ in range(steps):
        path.append(method.step(mechanism.integrate, acceleration, *path[-1], DURATION / steps))
    return _tumble(mechanism, path)


def path_compiled(body: TorqueFreeBody, method: Integrator, steps: int) -> Tumble:
    """Return the states over DURATION, computed by the simulation."""
    start = [float(x) for x in (*DRIFT, *body.rates(0.0))]
    values = {"rate": steps / DURATION, "duration": DURATION, "bodies.tennis_racket.mass": MASS,
              "bodies.tennis_racket.inertia": list(body.moments), "bodies.tennis_racket.velocity": start}  # fmt: skip
    run = simulate(_scene().with_values(values), Penalty(integrator=method.name), steps=steps)
    return _tumble(mechanism_of(body), zip(run.q, run.v, strict=True))


@cache
def _scene() -> Any:
    return load_scene(find_scene("tumbling_body"))


def _tumble(mechanism: Mechanism, path: Iterable[tuple[Floats, Floats]]) -> Tumble:
    states = [(*mechanism.placements(q), v) for q, v in path]
    axes, place, v = (np.array(part) for part in zip(*states, strict=True))
    return Tumble(axes[:, 0], v[:, 3:], place[:, 0], v[:, :3])


def _halved(
    body: TorqueFreeBody, method: Integrator, path: Callable[..., Tumble], halvings: int
) -> Iterator[dict[str, Any]]:
    """Yield errors, drifts and their orders for each step length."""
    truth = exact(body, DURATION)
    before = dict.fromkeys(ORDERS, np.nan)
    for k in range(halvings):
        steps = COARSEST[method.name] << k
        row = {"step [s]": DURATION / steps, **errors(path(body, method, steps), truth, body)}
        both = float(np.hypot(row["attitude error [rad]"], row["rate error [rad/s]"] / body.third_rate))
        now = {"order": both, "energy order": row["energy drift [relative]"],
               "momentum order": row["momentum drift [relative]"]}  # fmt: skip
        shown = {name: float(np.log2(before[name] / now[name])) for name in ORDERS if now[name] > ROUNDING}
        yield row | {name: shown[name] if np.isfinite(shown.get(name, np.nan)) else None for name in ORDERS}
        before = now


def errors(path: Tumble, truth: Tumble, body: TorqueFreeBody) -> dict[str, float]:
    """Return the errors at the end, and the largest drifts of energy and angular momentum along the path."""
    moments = np.array(body.moments)
    energy = 0.5 * (path.rate**2 @ moments + MASS * np.sum(path.velocity**2, axis=1))
    spin = np.einsum("nij,nj->ni", path.axes, moments * path.rate)
    return {
        "attitude error [rad]": float(np.linalg.norm(path.axes[-1] - truth.axes)) / np.sqrt(2.0),  # of small angles
        "rate error [rad/s]": float(np.linalg.norm(path.rate[-1] - truth.rate)),
        "place error [m]": float(np.linalg.norm(path.place[-1] - truth.place)),
        "energy drift [relative]": float(np.abs(energy / energy[0] - 1.0).max()),
        "momentum drift [relative]": float(np.linalg.norm(spin - spin[0], axis=1).max()) / body.momentum,
    }


def judged(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Judge the last measurable order of a series: it must be the declared one; drifts may have a higher order."""
    shown = [row for row in rows if row["order"] is not None]
    if shown:
        last = {name: [row[name] for row in rows if row[name] is not None] for name in ORDERS}
        shown[-1]["holds"] = _as_declared(last, shown[-1]["declared order"])
    return rows


def _as_declared(shown: dict[str, list[float]], declared: int) -> bool:
    """Whether the error has the declared order and each drift at least that order, or no order due to rounding."""
    drifts = [shown[name][-1] for name in DRIFT_ORDERS if shown[name]]
    equal = abs(shown["order"][-1] - declared) <= ORDER_TOLERANCE
    return bool(equal and all(order >= declared - ORDER_TOLERANCE for order in drifts))


def convergence(table: Table) -> str:
    """Return the measured orders of each integrator in words."""
    judges = [row for row, held in zip(table.records(), table.holds, strict=True) if held is not None]
    series = "; ".join(
        f"{words(name)}: {span([row['order'] for row in rows])} (declared {rows[0]['declared order']})"
        for (name,), rows in by(judges, "integrator").items()
    )
    return ("The motion of a free tumbling body converges to the closed form with the order that the integrator "
            "declares; its energy and angular momentum converge at least as fast. Measured orders: "
            f"{series}.")  # fmt: skip


TUMBLING = Check(
    key="tumbling", question="A tumbling body converges to the closed form.",
    cases=lambda _: product(MOTIONS, METHODS), row=_rows, says=convergence,
    note="Attitude and rate converge to the closed form with the order that the integrator declares; the drifts of "
         f"energy and angular momentum fall at least as fast. Tolerance: order within {ORDER_TOLERANCE} of the "
         "declared one, by the two finest steps above rounding.",
)  # fmt: skip
