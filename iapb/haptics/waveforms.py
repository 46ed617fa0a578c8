"""Force signals that render an impulse to the hand over one step or several (paper I, VIII).

A waveform is a list of weights w_j, j = 0 … n − 1, with Σ w_j = 1: the device renders the impulse
p of a collision as the forces w_j p/T in n successive steps of length T. So each waveform carries exactly the momentum
p, whatever its shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iapb.elementary import sine
from iapb.errors import ArgumentError
from iapb.names import one_of

Floats = NDArray[np.float64]


class Material(NamedTuple):
    """A decaying sinusoid A e^(−Bt) sin(2πft), multiplied by the impact speed.

    attack A [1/s], decay B [1/s], frequency f [Hz] were measured by tapping on real materials (Okamura, Dennerlein and
    Howe, Vibration feedback models for virtual environments, ICRA 1998).
    """

    attack: float
    decay: float
    frequency: float


MATERIALS = {
    "rubber": Material(116.7, 60.0, 18.0),
    "wood": Material(150.0, 80.0, 100.0),
    "aluminium": Material(300.0, 90.0, 300.0),
}

PULSE_SECONDS = 0.008  # of the braking pulse: about the fastest that a hand feels as one blow
_FADED = 6.907755278982137  # -ln 0.001: a sinusoid ends where its envelope has fallen to a thousandth


def step_weights(dt: float) -> Floats:
    """Return the weight of the paper's rendering: the whole impulse in one step."""
    return np.ones(1)


def brake_weights(dt: float) -> Floats:
    """Return the weights of a braking pulse: half a sine over PULSE_SECONDS, like a stiff damper that acts briefly."""
    count = max(1, round(PULSE_SECONDS / dt))
    return _summing_to_one(_sines(np.pi * (np.arange(count) + 0.5) / count))


def ring_weights(material: str) -> Callable[[float], Floats]:
    """Return a function dt -> weights: the whole momentum in one step, then the material's sinusoid without its mean.

    The sinusoid is the acceleration A e^(−Bt) sin(2πft) v of the mass m that the impulse (1 + e) m v acted on. For a
    plastic impact (e = 0) each step of length T gets the share T A e^(−Bt) sin(2πft) of the impulse.
    """
    attack, decay, frequency = MATERIALS[material]

    def weights(dt: float) -> Floats:
        time = dt * np.arange(1, max(2, round(_FADED / decay / dt)))
        if 2.0 * frequency * dt > 1.0:
            raise ArgumentError("waveform", f"ring-{material}", f"a material below half the rate: {frequency:g} Hz "
                                                               f"cannot be rendered at {1.0 / dt:g} Hz")
        envelope = np.array([float(Decimal(x).exp()) for x in (-decay * time).tolist()])  # integer arithmetic: no libm
        ringing = envelope * _sines(2.0 * np.pi * frequency * time)
        ringing -= envelope * (math.fsum(ringing) / math.fsum(envelope))  # so that the sinusoid carries no momentum
        return _summing_to_one(np.concatenate([[1.0], attack * dt * ringing]))

    return weights


WAVEFORMS: dict[str, Callable[[float], Floats]] = {
    "step": step_weights,
    "brake": brake_weights,
    **{f"ring-{material}": ring_weights(material) for material in MATERIALS},
}


def waveform_weights(name: str, dt: float) -> Floats:
    """Return the weights (n,) of a waveform for steps of dt [s]; their sum is 1 to rounding.

    Raises
    ------
    ArgumentError
        An unknown waveform, or one that this rate cannot render.
    """
    if name not in WAVEFORMS:
        raise ArgumentError("waveform", name, one_of(name, WAVEFORMS))
    return WAVEFORMS[name](dt)


def _sines(angles: NDArray[np.floating]) -> Floats:
    return np.array([sine(angle) for angle in angles.tolist()])


def _summing_to_one(weights: Floats) -> Floats:
    return weights / math.fsum(weights)
