"""Tumbling of a free body: errors of each integrator against the closed form, its drifts, and its measured order.

Closed form of a torque-free rigid body: Jacobi's elliptic functions for the rates, a quadrature for an angle.
Source: Landau and Lifshitz, Mechanics, section 37. Principal moments I1 < I2 < I3, energy E, angular momentum L with
L^2 > 2 E I2 (the body tumbles about its third axis); at t = 0 the second rate is zero and the others are positive:

    w1 = A cn(s t | m),  w2 = B sn(s t | m),  w3 = C dn(s t | m).

The attitude follows because L is constant in space: two angles between the body axes and L are algebraic functions of
w. The third satisfies d(psi)/dt = L (2 E - I3 w3^2) / (L^2 - I3^2 w3^2), which Gauss-Legendre quadrature integrates to
machine precision.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from iapb.contact.laws import Penalty
from iapb.mechanics.integrators import INTEGRATORS, Integrator
from iapb.mechanics.mechanism import Body, Joint, Mechanism
from iapb.scene import find_scene, load_scene
from iapb.simulation import simulate
from reference import Floats
from verification.check import Check, Study

_NODES = 20  # Gauss-Legendre nodes per quarter period: the integrand is smooth and the error is below 1e-15


@dataclass(frozen=True)
class TorqueFreeBody:
    """Ascending principal moments [kg m^2], and the amplitudes A and C [rad/s] of the first and third rate."""

    moments: tuple[float, float, float]
    first_rate: float
    third_rate: float

    @property
    def energy(self) -> float:
        """Kinetic energy [J]."""
        i1, _, i3 = self.moments
        return 0.5 * (i1 * self.first_rate**2 + i3 * self.third_rate**2)

    @property
    def momentum(self) -> float:
        """Magnitude of the angular momentum [N m s]."""
        i1, _, i3 = self.moments
        return sqrt((i1 * self.first_rate) ** 2 + (i3 * self.third_rate) ** 2)

    @property
    def speed_and_parameter(self) -> tuple[float, float]:
        """s [rad/s] and m of the elliptic functions."""
        i1, i2, i3 = self.moments
        twice, square = 2.0 * self.energy, self.momentum**2
        speed = sqrt((i3 - i2) * (square - twice * i1) / (i1 * i2 * i3))
        return speed, (i2 - i1) * (twice * i3 - square) / ((i3 - i2) * (square - twice * i1))

    @property
    def period(self) -> float:
        """Time [s] after which the rates repeat."""
        from scipy.special import ellipk

        speed, parameter = self.speed_and_parameter
        return float(4.0 * ellipk(parameter) / speed)

    def rates(self, time: Floats | float) -> Floats:
        """Angular velocity (..., 3) [rad/s] in body axes."""
        from scipy.special import ellipj

        i1, i2, i3 = self.moments
        speed, parameter = self.speed_and_parameter
        sn, cn, dn, _ = ellipj(speed * np.asarray(time), parameter)
        second = sqrt((2.0 * self.energy * i3 - self.momentum**2) / (i2 * (i3 - i2)))
        return np.stack([self.first_rate * cn, second * sn, self.third_rate * dn], axis=-1)

    def axes(self, time: float) -> Floats:
        """Body axes as columns (3, 3), in a frame whose z axis is along the angular momentum.

        R = Rz(psi) F(w), where F(w) rotates the direction of L in the body frame, h = I w / L, to z.
        """
        angle = self._turned(time)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return turn @ _frame(np.array(self.moments) * self.rates(time) / self.momentum)

    def _turned(self, time: float) -> float:
        """psi(t): the integral of L (2 E - I3 w3^2) / (L^2 - I3^2 w3^2)."""
        i3, momentum = self.moments[2], self.momentum
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        pieces = max(1, int(np.ceil(abs(time) / (0.25 * self.period))))
        edges = np.linspace(0.0, time, pieces + 1)
        half = 0.5 * (edges[1] - edges[0])
        places = edges[:-1, None] + half * (1.0 + nodes)
        third = i3 * self.rates(places)[..., 2]
        speed = momentum * (2.0 * self.energy - third**2 / i3) / (momentum**2 - third**2)
        return float(half * np.sum(speed @ weights))


def _frame(h: Floats) -> Floats:
    """Return F (3, 3) with F h = z and first row along e3 x h; F is smooth as long as h differs from e3."""
    across = np.array([-h[1], h[0], 0.0])
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(h, across), h])


MASS = 0.3  # [kg]
DRIFT = (0.2, -0.1, 0.3)  # velocity of the centre of mass [m/s]
DURATION = 2.0  # [s], about one period
# A gentle wobble, and a rotation close to the unstable middle axis, in which the body flips periodically.
MOTIONS = {
    "wobbling": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 1.0, 3.0),
    "turning over": TorqueFreeBody((1e-3, 2e-3, 2.8e-3), 4.0, 2.8),
}
# steps: enough to show the order
COARSEST = {"momentum": 200, "semi_implicit_euler": 800, "midpoint": 200, "runge_kutta_4": 100}
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


def _rows(study: Study, case: tuple[str, str]) -> list[dict[str, Any]]:
    """Return the rows of one motion by one integrator, with repeatedly halved steps."""
    head, method = {"motion": case[0], "integrator": case[1]}, INTEGRATORS[case[1]]
    halved = _halved(MOTIONS[case[0]], method, path_compiled, HALVINGS[study.depth])
    return judged([head | row | {"declared order": method.group_order} for row in halved])


def exact(body: TorqueFreeBody, time: float) -> Tumble:
    """Return the closed-form state; at time 0 the world frame is the body frame at the centre of mass."""
    axes = body.axes(0.0).T @ body.axes(time)
    drift = np.array(DRIFT)
    return Tumble(axes, body.rates(time), drift * time, axes.T @ drift)


def path_compiled(body: TorqueFreeBody, method: Integrator, steps: int) -> Tumble:
    """Return the states over DURATION, computed by the simulation."""
    start = [float(x) for x in (*DRIFT, *body.rates(0.0))]
    values = {"rate": steps / DURATION, "duration": DURATION, "bodies.tennis_racket.mass": MASS,
              "bodies.tennis_racket.inertia": list(body.moments), "bodies.tennis_racket.velocity": start}  # fmt: skip
    scene = load_scene(find_scene("tumbling_body")).with_values(values)
    run = simulate(scene, Penalty(integrator=method.name), steps=steps)
    mechanism = Mechanism([Body("body", None, Joint("free_flyer"), mass=MASS, inertia=np.diag(body.moments))])
    axes, place = (np.array(part) for part in zip(*map(mechanism.placements, run.q), strict=True))
    return Tumble(axes[:, 0], run.v[:, 3:], place[:, 0], run.v[:, :3])


def _halved(
    body: TorqueFreeBody, method: Integrator, path: Callable[..., Tumble], halvings: int
) -> Iterator[dict[str, Any]]:
    """Yield errors, drifts and their orders for each step length."""
    truth, before = exact(body, DURATION), dict[str, float]()
    for k in range(halvings):
        steps = COARSEST[method.name] << k
        row = {"step [s]": DURATION / steps, **errors(path(body, method, steps), truth, body)}
        both = float(np.hypot(row["attitude error [rad]"], row["rate error [rad/s]"] / body.third_rate))
        now = {"order": both, "energy order": row["energy drift [relative]"],
               "momentum order": row["momentum drift [relative]"]}  # fmt: skip
        yield row | {name: float(np.log2(before[name] / now[name])) if before and now[name] > ROUNDING else None
                     for name in ORDERS}  # fmt: skip
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
        last, declared = shown[-1], shown[-1]["declared order"]
        drifts = [own[-1] for name in DRIFT_ORDERS if (own := [row[name] for row in rows if row[name] is not None])]
        last["holds"] = (abs(last["order"] - declared) <= ORDER_TOLERANCE
                         and all(order >= declared - ORDER_TOLERANCE for order in drifts))  # fmt: skip
    return rows


TUMBLING = Check(
    key="tumbling", question="A tumbling body converges to the closed form with the order that the integrator "
    "declares; its energy and angular momentum converge at least as fast.",
    cases=lambda _: product(MOTIONS, INTEGRATORS), row=_rows,
    note=f"Tolerance: order within {ORDER_TOLERANCE} of the declared one, measured at the two finest steps with errors "
         "above rounding. Only the row of this order decides; the others cannot tell.",
)  # fmt: skip
