"""Print hashes of short runs and of 200 impacts as JSON: the same on every processor.

The numbers of the impacts are small integers over powers of two, so that they are the same
everywhere, too.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from iapb.contact.impact import resolve_frictional_impact, resolve_impact
from iapb.haptics.coupling import FourChannel
from iapb.haptics.device import SimulatedDevice
from iapb.scene import load_scene
from iapb.simulation import simulate
from reports.store.keys import content_hash

SCENES = Path(__file__).parents[2] / "scenes"
STEPS = 150  # of each scene: the first impacts are among them
GAINS = FourChannel((100.0, 100.0, 0.5), (70.0, 70.0, 0.375))


def hashes() -> dict[str, str]:
    """Return two hashes for each scene's run, as shipped and with implicit contact, and one for
    each kind of impact."""
    found = {}
    for path in sorted(SCENES.glob("*.yaml")):
        scene = load_scene(path)
        implicit = scene.with_values({"contact.forces": "implicit"})
        for name, one in ((path.stem, scene), (f"implicit {path.stem}", implicit)):
            found[name] = content_hash(simulate(one, steps=min(STEPS, one.steps)))
    peg = load_scene(SCENES / "peg_corner.yaml")
    found["coupled peg"] = content_hash(simulate(peg, steps=STEPS, coupling=GAINS))
    found["device"] = _device_hash()
    plain = [resolve_impact(M, J, v, 0.5) for M, J, v in _impacts()]
    plain += [resolve_impact(M, J, v, np.arange(len(J)) / 16.0) for M, J, v in _impacts()]
    rough = [
        resolve_frictional_impact(M, J, np.roll(J, 1, axis=1), v, 0.5, 0.25)
        for M, J, v in _impacts()
    ]
    answers = [array for one in (*plain, *rough) for array in (one.velocity, one.impulses)]
    found["impacts"] = _hash([*answers, *(one.tangential_impulses for one in rough)])
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


def _hash(arrays: list[Any]) -> str:
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


if __name__ == "__main__":
    print(json.dumps(hashes()))
