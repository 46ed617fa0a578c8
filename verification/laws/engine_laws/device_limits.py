"""Law for an impulse that the device cannot render (paper section VI).

One factor for the whole group keeps tool and device passive, because it acts as an effective restitution in [−1, e].
Clipping each component separately does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from iapb.contact.kernels.collide import largest_share
from verification.impacts import Floats, ImpactCase, draw_case
from verification.laws.bounds import KIT, LawResidual
from verification.laws.impact_laws import relative_gain

# (impulse (d,), dt, force limit (d,)) -> (impulse that the tool gets (d,), force that the device applies (d,))
Renderer = Callable[[Floats, float, Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class LimitedImpact:
    """An impact, its full impulse, and a device of limited force with the same mass matrix as the tool."""

    impact: ImpactCase
    impulse: Floats  # (d,) [N s, N m s]
    dt: float
    force_limit: Floats  # (d,) [N, N m], infinite for no limit


def draw(rng: np.random.Generator) -> LimitedImpact:
    """Draw an impact and force limits between 0.01 and 10 times the force that its impulse needs, or infinite."""
    case = draw_case(rng)
    Q, u = case.row_space, case.lower.T @ case.velocity
    impulse = -(1.0 + case.restitution) * (case.lower @ (Q.T @ (Q @ u)))
    dt = float(rng.choice([1.0 / 512.0, 1e-3]))
    limit = (np.abs(impulse) / dt + 1e-9) * 10.0 ** rng.uniform(-2.0, 1.0, size=len(u))
    return LimitedImpact(case, impulse, dt, np.where(rng.random(len(u)) < 0.2, np.inf, limit))


def ours(impulse: Floats, dt: float, force_limit: Floats) -> tuple[Floats, Floats]:
    """Scale the impulse as the engine does."""
    share = largest_share(impulse, np.arange(len(impulse)), len(impulse), dt, force_limit)
    return share * impulse, share * impulse / dt


def saturated(impulse: Floats, dt: float, force_limit: Floats) -> tuple[Floats, Floats]:
    """The paper's first strategy: the tool gets the full impulse, the device each component clipped. Not passive."""
    return impulse, np.clip(impulse / dt, -force_limit, force_limit)


def saturation_counterexample() -> LimitedImpact:
    """Return a point mass of 1 kg that hits an inclined wall with e = 0; its device can hardly push along y.

    The full impulse (0.12, 0.16) N s takes 2 % of the kinetic energy. The device renders only (0.12, 0.01) N s and
    gains 12 %.
    """
    normal, velocity = np.array([0.6, 0.8]), np.array([1.0, -1.0])
    case = ImpactCase(np.eye(2), normal[None], velocity, 0.0, "clipped component by component")
    return LimitedImpact(case, -normal * float(normal @ velocity), 1e-3, np.array([1000.0, 10.0]))


def limited_impulses_are_passive(case: LimitedImpact, subject: Renderer) -> LawResidual:
    """Larger relative energy gain of tool and device, both from v⁻; infinite if the device exceeds its limit."""
    tool_impulse, device_force = subject(case.impulse.copy(), case.dt, case.force_limit.copy())
    gains = [_gain(case.impact, tool_impulse), _gain(case.impact, case.dt * device_force)]
    value = np.inf if np.any(np.abs(device_force) > case.force_limit) else max(gains)
    return LawResidual("device_limits", value, KIT.comparison(case.impact))


def _gain(case: ImpactCase, impulse: Floats) -> float:
    return relative_gain(case, case.velocity + np.linalg.solve(case.mass_matrix, impulse))
