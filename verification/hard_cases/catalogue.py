"""The catalogue of hard cases: the impacts of impacts.yaml, then the motions of motions.yaml."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from iapb.scene import find_scene, load_scene
from verification.hard_cases import friction, motions, numerical
from verification.hard_cases.case import (
    AnyCase,
    FrictionalCase,
    HardCase,
    TrajectoryCase,
    scene_named,
    written,
)

MEASURES = {
    measure.__name__: measure
    for measure in (
        motions.chatter,
        motions.cradle,
        motions.wall,
        motions.wedged_peg,
        friction.creep,
        friction.double_pendulum,
        friction.nudged_box,
        friction.on_a_slope,
        friction.painleve_rod,
        friction.pushed,
        friction.stick_slip,
    )
}


def impact_named(name: str) -> HardCase:
    """Return an impact of impacts.yaml."""
    given = written("impacts.yaml")[name]
    if "made by" in given:
        make = _called(vars(numerical), given["made by"])
        numbers = make()._asdict()
        exact = None
    else:
        arrays = {key: np.array(given[key], dtype=object) for key in "MJveT" if key in given}
        rows = _fractions(arrays["J"])
        exact = rows if "/" in str(given["J"]) else None
        numbers = {key: _fractions(array).astype(float) for key, array in arrays.items()}
    mass = numbers["M"]
    e = np.asarray(numbers["e"])
    arguments: dict[str, Any] = dict(
        **_texts(given),
        mass_matrix=np.diag(mass) if mass.ndim == 1 else mass,
        contact_jacobian=numbers["J"],
        velocity=numbers["v"],
        restitution=e if e.ndim else float(e),
        exact_jacobian=exact,
        well_posed=given.get("well posed", True),
        methods=tuple(given["methods"]) if "methods" in given else None,
    )
    if "T" in given:
        return FrictionalCase(**arguments, tangent=numbers["T"], friction=float(given["friction"]))
    return HardCase(**arguments)


def motion_named(name: str) -> TrajectoryCase:
    """Return a motion of motions.yaml."""
    given = written("motions.yaml")[name]
    known = given["scene"] in written("scenes.yaml")
    scene = scene_named(given["scene"]) if known else load_scene(find_scene(given["scene"]))
    return TrajectoryCase(
        **_texts(given),
        law=given["law"],
        scene=scene.with_values(given.get("values", {})),
        measure=_called(MEASURES, given["measure"]),
        worlds=tuple(given["worlds"]),
    )


def _texts(given: dict[str, Any]) -> dict[str, str]:
    """Return the texts for the report."""
    return {key.replace(" ", "_"): given[key] for key in ("name", "source", "why hard", "expected")}


def _called(functions: dict[str, Any], given: Any) -> Callable[..., Any]:
    """Return a function by its name, or with the arguments after its name."""
    if isinstance(given, str):
        return functions[given]
    ((name, arguments),) = given.items()
    return partial(functions[name], **arguments)


def _fractions(array: Any) -> Any:
    """Return the array with texts such as "3/5" as fractions."""
    return np.vectorize(lambda x: Fraction(x) if isinstance(x, str) else x, otypes=[object])(array)


# To add a case, write it in one of the files, or add a function that returns it.
HARD_CASES: dict[str, Callable[[], AnyCase]] = {
    **{name: partial(impact_named, name) for name in written("impacts.yaml")},
    **{name: partial(motion_named, name) for name in written("motions.yaml")},
}
