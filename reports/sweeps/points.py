"""Points of a sweep: what each changes, in a fixed order, each with a key that does not depend on that order."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from reports.store.keys import canonical_json
from reports.sweeps.study import Study

LAW = "law."  # paths below it are settings of the contact law


@dataclass(frozen=True)
class Point:
    """One simulation of a sweep: plain values, so that it travels to another machine.

    scene : path of the scene's file or its name; values : by scene path; law : settings of the law by name
    """

    index: int
    scene: str
    world: str
    rendering: str
    values: dict[str, Any]
    law: dict[str, Any]

    def key(self, code: str) -> str:
        """Hash of what is asked for, by the given version of code and scene."""
        asked = {"world": self.world, "rendering": self.rendering, "values": self.values, "law": self.law}
        return hashlib.sha256(canonical_json({"asked": asked, "code": code}).encode()).hexdigest()[:32]


def points_of(study: Study, scene: str) -> Iterator[Point]:
    """Yield the points: worlds outermost, then the grid in the order of its axes, the draws innermost."""
    axes = study.axes()
    combinations = itertools.product(study.worlds, itertools.product(*axes.values()))
    index = 0
    for world, chosen in combinations:
        for drawn in draws(study):
            given = {**study.values, **dict(zip(axes, chosen, strict=True)), **drawn}
            law = {path.removeprefix(LAW): value for path, value in given.items() if path.startswith(LAW)}
            values = {path: value for path, value in given.items() if not path.startswith(LAW)}
            yield Point(index, scene, world, study.rendering, values, law)
            index += 1


def draws(study: Study) -> Iterator[dict[str, float]]:
    """Yield the random values; draw number i has a generator of its own, so that more draws change none before."""
    if study.random is None:
        yield {}
        return
    for i in range(study.random.count):
        rng = np.random.default_rng([study.random.seed, i])
        yield {path: float(rng.uniform(span.start, span.stop)) for path, span in study.random.values.items()}
