"""URDF texts of random robots: every joint type, turned inertias, names out of order. What a reader must read right.

Only what both readers define alike is written: a planar joint lies across z, as Pinocchio takes no other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reference.random_mechanisms import random_inertia

Floats = NDArray[np.float64]

TYPES = ("revolute", "continuous", "prismatic", "planar", "floating", "fixed")


def random_urdf(rng: np.random.Generator, links: int, types: tuple[str, ...] = TYPES) -> str:
    """Return a robot of one base and `links` moving links, each on a random earlier one."""
    names = [f"link_{k}" for k in rng.permutation(links + 1)]
    joints = [f"joint_{k}" for k in rng.permutation(links)]  # siblings are ordered by these, not by their lines
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
    axis = (0.0, 0.0, 1.0) if kind == "planar" else rng.normal(size=3)
    limits = '<limit lower="-3" upper="3" effort="10" velocity="10"/>'
    return (f'<joint name="{name}" type="{kind}">{_origin(rng)}<parent link="{parent}"/><child link="{child}"/>'
            f'<axis xyz="{_numbers(axis)}"/>{limits}</joint>')  # fmt: skip


def _origin(rng: np.random.Generator) -> str:
    return f'<origin xyz="{_numbers(rng.normal(scale=0.3, size=3))}" rpy="{_numbers(rng.uniform(-3, 3, size=3))}"/>'


def _numbers(values: Floats | tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)
