"""Laws that need more than an impact resolver: a row budget, device limits, a wall or a device held by the hand, inputs
of any size.

Each law draws its own cases and judges its own kind of subject; `ours` is the engine's subject. To add a law, write its
file, add a line to ENGINE_LAWS, and add a planted fault to `planted_runs`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from verification.laws.bounds import LawResidual
from verification.laws.engine_laws import (
    device_limits,
    device_port,
    extremes,
    group_splitting,
    hand_port,
    truncation,
)


class EngineLaw(NamedTuple):
    """A law: its statement in words, the generator of its cases, its check and the engine's subject."""

    statement: str
    draw: Callable[[np.random.Generator], Any]
    check: Callable[[Any, Any], LawResidual]
    ours: Callable[..., Any]


ENGINE_LAWS: dict[str, EngineLaw] = {
    "truncation": EngineLaw(
        "a result cut short at any number of rows is passive, and none is no impulse",
        truncation.draw, truncation.every_budget_is_passive, truncation.ours),
    "device_limits": EngineLaw(
        "an impulse cut to the device's limits by one factor per group is passive for tool and device",
        device_limits.draw, device_limits.limited_impulses_are_passive, device_limits.ours),
    "group_splitting": EngineLaw(
        "two groups that share nothing move the same, simulated together or apart",
        group_splitting.draw, group_splitting.groups_apart_move_alike, group_splitting.ours),
    "hand_port": EngineLaw(
        "the hand gets no energy out of a sampled wall while b ≥ KT/2 + |B|",
        hand_port.draw, hand_port.hand_port_is_passive, hand_port.ours),
    "extremes": EngineLaw(
        "every finite input gives a finite motion or an error by name",
        extremes.draw, extremes.finite_or_named, extremes.ours),
    "device_port": EngineLaw(
        "the hand gets no energy out of a device coupled to a tool on a rigid wall while b ≥ K_cpl T/2 + B_cpl",
        device_port.draw, device_port.device_port_is_passive, device_port.ours),
}  # fmt: skip


@dataclass(frozen=True)
class EngineVerdict:
    """Verdict on one law. `worst` is the residual closest to its tolerance or furthest above it; `case` is the first
    case that breaks the law, or None.
    """

    law: str
    statement: str
    checked: int
    failures: int
    worst: LawResidual
    case: Any

    @property
    def passed(self) -> bool:
        """Whether no case broke the law."""
        return self.failures == 0


def judge_engine_law(name: str, subject: Callable[..., Any] | None = None, cases: int = 300,
                     seed: int = 0) -> EngineVerdict:
    """Check one law on `cases` random cases; `subject` replaces the engine's own subject."""
    law, rng = ENGINE_LAWS[name], np.random.default_rng([seed, list(ENGINE_LAWS).index(name)])
    worst, failures, broken = LawResidual(name, -np.inf, 1.0), 0, None
    for _ in range(cases):
        case = law.draw(rng)
        residual = law.check(case, law.ours if subject is None else subject)
        failures += not residual.passed
        broken = case if broken is None and not residual.passed else broken
        worst = residual if not residual.ratio <= worst.ratio or worst.value == -np.inf else worst
    return EngineVerdict(name, law.statement, cases, failures, worst, broken)
