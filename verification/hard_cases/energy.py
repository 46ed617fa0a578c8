"""What a motion's energy may not do, from its record alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.run import Run

Floats = NDArray[np.float64]


def largest_gain(run: Run) -> float:
    """Return the most that tool and device ever held beyond what they had and what the hand gave, relative.

    Kinetic energy of tool and device and the tool's potential energy, less the hand's work on both; relative to the
    most energy that was there or was given. Springs of walls and coupling hold some of it, never less than none:
    what is found here above zero was made from nothing.
    """
    ledger = run.energy
    works = [work for name, work in ledger.items() if name in ("hand_work", "device_hand_work")]
    kinetic = sum((ledger[name] for name in ("kinetic", "device_kinetic") if name in ledger), np.zeros(run.steps + 1))
    given = sum((_from_zero(work) for work in works), np.zeros(run.steps + 1))
    gain = kinetic - kinetic[0] + ledger["potential"] - ledger["potential"][0] - given
    dropped = float(ledger["potential"][0] - ledger["potential"].min())
    fed = float(kinetic[0] + np.abs(given).max()) + dropped
    return float(gain.max()) / max(fed, float(np.finfo(float).tiny))


def _from_zero(work: Floats) -> Floats:
    """Work by the end of each step, as values at the instants."""
    return np.concatenate([[0.0], work])
