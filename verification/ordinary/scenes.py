"""Ordinary scenes with their truths: what somebody tries on the first day, only friction and
restitution set.

Every scene runs at 1 kHz. The scenes are in scenes.yaml, what is known of each in cases.yaml: a
quantity of the motion, and its true value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from iapb.scene.expressions import function_of
from iapb.scene.reading import scene_from_values
from verification.data import data_of
from verification.ordinary import quantities, truths
from verification.ordinary.quantities import Motion as Motion

Values = dict[str, Any]  # a scene, or what is known of it, as it stands in a file
DROP = 0.3  # [m] height from which a ball of RADIUS falls, and bounces
RADIUS = 0.03


@dataclass(frozen=True)
class Case:
    """A scene with its truth.

    truth, scale : values as in cases.yaml, or functions that compute them; scale : what the error
        is divided by, in the unit of the quantity
    tolerance : largest relative error that is right
    """

    family: str
    scene: Values
    quantity: Callable[[Motion], Any]
    truth: Any
    scale: Any
    says: str
    tolerance: float = 0.01

    def error(self, motion: Motion) -> float:
        """Return the largest difference of the quantity from its truth by the scale; inf for a
        broken run."""
        if not all(np.isfinite(part).all() for part in motion):
            return math.inf
        off = np.abs(np.asarray(self.quantity(motion)) - value_of(self.truth))
        return float(np.max(off)) / float(value_of(self.scale))


def value_of(given: Any) -> Any:
    """Return a value of cases.yaml: a number, an expression, a list of values, or a function of
    `truths` with its arguments."""
    match given:
        case str():
            return function_of(given)(0.0)
        case list():
            return [value_of(part) for part in given]
        case dict():
            ((name, arguments),) = given.items()
            return getattr(truths, name)(**arguments)
    return given() if callable(given) else given


def stack(
    boxes: int, shift: float, mass: float = 1.0, duration: float = 2.0, space: bool = False
) -> Values:
    """Return a scene of boxes of 0.1 m on each other, every second one shifted."""
    inertia = mass * 0.1**2 / 6.0
    bodies = list[Values]()
    for i in range(boxes):
        x = (i % 2) * shift
        y = 0.05 + 0.1 * i
        bodies.append(
            {
                "name": f"box_{i}",
                "joint": "free_flyer" if space else "planar",
                "mass": mass,
                "inertia": [inertia] * 3 if space else inertia,
                "shapes": [{"kind": "box", "size": [0.1] * (2 + space)}],
                "position": [x, x, y, 0.0, 0.0, 0.0, 1.0] if space else [x, y, 0.0],
            }
        )
    floor = data_of(__file__, "scenes.yaml")["walls"]["ground" if space else "floor"]
    return {
        **({"dimensions": 3} if space else {}),
        "duration": duration,
        "gravity": [0.0, 0.0, -truths.G] if space else [0.0, -truths.G],
        "bodies": bodies,
        "walls": floor,
        "contact": {"friction": 0.5},
    }


def free(scene: Values, arm: float, axes: Sequence[int] = (0, 1, 2)) -> Values:
    """Return what is known of a scene without contact: where points of all bodies are, beside the
    longest way of a point."""
    true = cache(lambda: truths.free_motion(scene_from_values(scene)))
    measured = partial(quantities.at_instants, arm=arm, axes=axes)
    return {
        "quantity": measured,
        "truth": lambda: measured(true()),
        "scale": lambda: quantities.way(true(), arm, axes),
        "says": f"DOP853; points at {arm:g} m of all bodies; scale: their longest way",
    }


def stands(scene: Values, size: float = 0.05, most: float = 1e-3) -> Values:
    """Return what is known of a scene that stands: no point at `size` from a body's origin moves
    by more than `most` [m]."""
    return {
        "quantity": partial(quantities.farthest, size=size),
        "truth": 0.0,
        "scale": 0.1,
        "says": f"stands: moves less than {1e3 * most:g} mm; scale 0.1 m",
        "tolerance": most / 0.1,
    }


def bounces(scene: Values, e: float, count: int, axis: int = 1) -> Values:
    """Return what is known of a ball that falls: its heights after each bounce."""
    fall = math.sqrt(2 * DROP / truths.G)
    touches = [fall * (1 + 2 * sum(e**k for k in range(1, n + 1))) for n in range(count + 1)]
    return {
        "quantity": partial(quantities.heights, touches=touches, above=RADIUS, axis=axis),
        "truth": [DROP * e ** (2 * n) for n in range(1, count + 1)],
        "scale": DROP,
        "says": f"heights after {count} bounces, e² each",
    }


FORMS: dict[str, Callable[..., Values]] = {"free": free, "stands": stands, "bounces": bounces}


def _case(family: str, name: str, known: Values) -> Case:
    """Return a case of cases.yaml; its form, or else its quantity, is the first key."""
    written = data_of(__file__, "scenes.yaml")[name]
    made = stack(**written["stack"]) if "stack" in written else written
    scene = {"name": name, "rate": 1000} | made
    form, given = next(iter(known.items()))
    others = {key: value for key, value in known.items() if key != form}
    if form in FORMS:
        return Case(family, scene, **FORMS[form](scene, **given) | others)
    ((what, arguments),) = {given: {}}.items() if isinstance(given, str) else given.items()
    quantity = partial(getattr(quantities, what), **arguments)
    return Case(family, scene, quantity, **others)


CASES: dict[str, Case] = {
    name: _case(family, name, known)
    for family, cases in data_of(__file__, "cases.yaml").items()
    for name, known in cases.items()
}
