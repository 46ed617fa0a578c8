"""Force signals that render an impulse to the hand over one step or several (paper I, VIII).

A waveform is a list of weights w_j, j = 0 … n − 1, with Σ w_j = 1: the device renders the impulse
p of a collision as the forces w_j p/T in n successive steps of length T. So each waveform carries exactly the momentum
p, whatever its shape.
"""

from __future__ import annotations

import math

import numpy as np

from iapb.elementary import sine_cosine
from iapb.errors import ArgumentError
from iapb.names import one_of
from iapb.schema import Floats

WAVEFORMS = ("step", "brake")
PULSE_SECONDS = 0.008  # of the braking pulse: about the fastest that a hand feels as one blow


def waveform_weights(name: str, dt: float) -> Floats:
    """Return the weights (n,) of a waveform for steps of dt [s]; their sum is 1 to rounding.

    ``step`` is the paper's rendering: the whole impulse in one step. ``brake`` is half a sine over PULSE_SECONDS, like
    a stiff damper that acts briefly.

    Raises
    ------
    ArgumentError
        An unknown waveform.
    """
    if name not in WAVEFORMS:
        raise ArgumentError("waveform", name, one_of(name, WAVEFORMS))
    if name == "step":
        return np.ones(1)
    count = max(1, round(PULSE_SECONDS / dt))
    weights = np.array([sine_cosine(angle)[0] for angle in (np.pi * (np.arange(count) + 0.5) / count).tolist()])
    return weights / math.fsum(weights)
