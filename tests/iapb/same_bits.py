"""Print hashes of short runs and of 200 impacts as JSON: the same on every processor.

The numbers of the impacts are small integers over powers of two, so that they are the same
everywhere, too.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iapb.contact.impact import resolve_frictional_impact, resolve_impact
from iapb.haptics.coupling import FourChannel
from iapb.haptics.device import SimulatedDevice
from iapb.scene import load_scene
from iapb.simulation import simulate

SCENES = Path(__file__).parents[2] / "scenes"
STEPS = 150  # of each scene: the first impacts are among them
GAINS = FourChannel((100.0, 100.0, 0.5), (70.0, 70.0, 0.375))


def hashes() -> dict[str, str]:
    """Return two hashes for each scene's run, as shipped and with implicit contact, and one for
    each kind of impact."""
    found = {path.stem: _run_hash(load_scene(path)) for path in sorted(SCENES.glob("*.yaml"))}
    for path in sorted(SCENES.glob("*.yaml")):
        scene = load_scene(path).with_values({"contact.forces": "implicit"})
        found[f"implicit {path.stem}"] = _run_hash(scene)
    found["coupled peg"] = _run_hash(load_scene(SCENES / "peg_corner.yaml"), coupling=GAINS)
    found["device"] = _device_hash()
    answers = [resolve_impact(M, J, v, 0.5) for M, J, v in _impacts()]
    found["factored"] = _hash([(answer.velocity, answer.impulses) for answer in answers])
    poisson = [resolve_impact(M, J, v, np.arange(len(J)) / 16.0) for M, J, v in _impacts()]
    found["poisson"] = _hash([(answer.velocity, answer.impulses) for answer in poisson])
    rough = [
        resolve_frictional_impact(M, J, np.roll(J, 1, axis=1), v, 0.5, 0.25)
        for M, J, v in _impacts()
    ]
    found["friction"] = _hash(
        [(answer.velocity, answer.impulses, answer.tangential_impulses) for answer in rough]
    )
    return found


def _impacts() -> Any:
    """Yield 200 impacts on 2 to 7 coordinates with 1 to 8 rows, some of them dependent, of unequal
    size."""
    numbers = np.random.default_rng(13)
    for k in range(200):
        d = 2 + k % 6
        c = 1 + k % 8
        factor = numbers.integers(-8, 9, (d, d))
        J = numbers.integers(-8, 9, (c, d)) * 2.0 ** numbers.integers(-3, 4, (c, 1))
        yield (factor @ factor.T) / 16.0 + np.eye(d) / 4.0, J, numbers.integers(-64, 65, d) / 32.0


def _device_hash() -> str:
    device = SimulatedDevice(
        [[2.0, 0.3, 0.1], [0.3, 1.5, 0.2], [0.1, 0.2, 0.7]], np.zeros(3), dt=1e-3
    )
    for k in range(50):
        device.apply([0.1 * k, -0.3, 1.0 / (k + 1)])
    return _hash([device.q, device.v])


def _run_hash(scene: Any, **options: Any) -> str:
    run = simulate(scene, steps=min(STEPS, scene.steps), **options)
    return _hash(
        [getattr(run, field.name) for field in fields(run) if not field.name.startswith("chunk_")]
    )


def _hash(value: Any) -> str:
    digest = hashlib.sha256()
    _add(digest, value)
    return digest.hexdigest()[:16]


def _add(digest: Any, value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(value.tobytes())
    elif isinstance(value, dict):
        _add(digest, [item for pair in value.items() for item in pair])
    elif isinstance(value, list | tuple):
        for item in value:
            _add(digest, item)
    elif is_dataclass(value):
        _add(digest, [getattr(value, field.name) for field in fields(value)])
    else:
        digest.update(repr(value).encode())


if __name__ == "__main__":
    print(json.dumps(hashes()))
