"""Closed form of a torque-free rigid body: Jacobi's elliptic functions for the rates, a quadrature
for an angle.

Source: Landau and Lifshitz, Mechanics, section 37. Principal moments I1 < I2 < I3, energy E,
angular momentum L with L^2 > 2 E I2 (the body tumbles about its third axis); at t = 0 the second
rate is zero and the others are positive:

    w1 = A cn(s t | m),  w2 = B sn(s t | m),  w3 = C dn(s t | m).

The attitude follows because L is constant in space: two angles between the body axes and L are
algebraic functions of w. The third satisfies d(psi)/dt = L (2 E - I3 w3^2) / (L^2 - I3^2 w3^2),
which Gauss-Legendre quadrature integrates to machine precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.special import ellipj, ellipk

from reference import Floats

# Gauss-Legendre nodes per quarter period: the integrand is smooth and the error is below 1e-15
_NODES = 20


@dataclass(frozen=True)
class TorqueFreeBody:
    """Ascending principal moments [kg m^2], and the amplitudes A and C [rad/s] of the first and
    third rate."""

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
        twice = 2.0 * self.energy
        square = self.momentum**2
        speed = sqrt((i3 - i2) * (square - twice * i1) / (i1 * i2 * i3))
        return speed, (i2 - i1) * (twice * i3 - square) / ((i3 - i2) * (square - twice * i1))

    @property
    def period(self) -> float:
        """Time [s] after which the rates repeat."""
        speed, parameter = self.speed_and_parameter
        return float(4.0 * ellipk(parameter) / speed)

    def rates(self, time: Floats | float) -> Floats:
        """Angular velocity (..., 3) [rad/s] in body axes."""
        i1, i2, i3 = self.moments
        speed, parameter = self.speed_and_parameter
        sn, cn, dn, _ = ellipj(speed * np.asarray(time), parameter)
        second = sqrt((2.0 * self.energy * i3 - self.momentum**2) / (i2 * (i3 - i2)))
        return np.stack([self.first_rate * cn, second * sn, self.third_rate * dn], axis=-1)

    def axes(self, time: float) -> Floats:
        """Body axes as columns (3, 3), in a frame whose z axis is along the angular momentum.

        R = Rz(psi) F(w), where F(w) rotates the direction of L in the body frame, h = I w / L, to
        z.
        """
        angle = self._turned(time)
        c = np.cos(angle)
        s = np.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return turn @ _frame(np.array(self.moments) * self.rates(time) / self.momentum)

    def _turned(self, time: float) -> float:
        """psi(t): the integral of L (2 E - I3 w3^2) / (L^2 - I3^2 w3^2)."""
        i3 = self.moments[2]
        momentum = self.momentum
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        pieces = max(1, int(np.ceil(abs(time) / (0.25 * self.period))))
        edges = np.linspace(0.0, time, pieces + 1)
        half = 0.5 * (edges[1] - edges[0])
        places = edges[:-1, None] + half * (1.0 + nodes)
        third = i3 * self.rates(places)[..., 2]
        speed = momentum * (2.0 * self.energy - third**2 / i3) / (momentum**2 - third**2)
        return float(half * np.sum(speed @ weights))


def _frame(h: Floats) -> Floats:
    """Return F (3, 3) with F h = z and first row along e3 x h; F is smooth as long as h differs
    from e3."""
    across = np.array([-h[1], h[0], 0.0])
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(h, across), h])
