"""URDF texts of random robots, to test URDF readers: every joint type, rotated inertias, names out of order.

The texts use only features that both readers define alike: no planar joints, whose coordinates differ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reference.random_mechanisms import random_inertia

Floats = NDArray[np.float64]

TYPES = ("revolute", "continuous", "prismatic", "floating", "fixed")


def random_urdf(rng: np.random.Generator, links: int, types: tuple[str, ...] = TYPES) -> str:
    """Return a robot with a base and `links` further links, each attached to a random earlier link."""
    names = [f"link_{k}" for k in rng.permutation(links + 1)]
    joints = [f"joint_{k}" for k in rng.permutation(links)]  # these names order siblings, not the lines of the text
    parts = [_link(rng, name) for name in names]
    for k, joint in enumerate(joints, start=1):
        kind = types[k % len(types)]
        parts.append(_joint(rng, joint, kind, names[int(rng.integers(k))], names[k]))
    return "\n".join(['<robot name="random">', *parts, "</robot>"])


def _link(rng: np.random.Generator, name: str) -> str:
    mass = 10.0 ** rng.uniform(-1.0, 1.0)
    inertia = random_inertia(rng, mass)
    places = [(i, j) for i in range(3) for j in range(i, 3)]
    entries = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{float(inertia[i, j])!r}"' for i, j in places)
    return (f'<link name="{name}"><inertial>{_origin(rng)}<mass value="{mass!r}"/>'
            f"<inertia {entries}/></inertial></link>")  # fmt: skip


def _joint(rng: np.random.Generator, name: str, kind: str, parent: str, child: str) -> str:
    axis = rng.normal(size=3)
    limits = '<limit lower="-3" upper="3" effort="10" velocity="10"/>'
    return (f'<joint name="{name}" type="{kind}">{_origin(rng)}<parent link="{parent}"/><child link="{child}"/>'
            f'<axis xyz="{_numbers(axis)}"/>{limits}</joint>')  # fmt: skip


def _origin(rng: np.random.Generator) -> str:
    return f'<origin xyz="{_numbers(rng.normal(scale=0.3, size=3))}" rpy="{_numbers(rng.uniform(-3, 3, size=3))}"/>'


def _numbers(values: Floats | tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
