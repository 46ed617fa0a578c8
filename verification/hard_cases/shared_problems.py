"""Hard problems by others, from the folder ../shared/problems next to the project; absent files raise CaseAbsent."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from iapb.run import Run
from reference.datasets import read_problem
from verification.hard_cases.case import (
    NO_GAIN,
    CaseAbsent,
    HardCase,
    Measured,
    TrajectoryCase,
    ball,
    largest_gain,
    on_floor,
)

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "problems"
_NOISE = 1e-10  # share of the largest eigenvalue of W; smaller eigenvalues in these files are rounding noise


def find_problem(place: str) -> Path:
    """Return the path of a file of the folder, or raise CaseAbsent with its name."""
    path = FOLDER / place
    if not path.is_file():
        raise CaseAbsent(f"needs ../shared/problems/{place} beside the project")
    return path


def bowl(number: int, what: str, why_hard: str, expected: str, e: float) -> HardCase:
    """Return a pile in a bowl: M = 1, J with J Jᵀ = W up to the noise of the file, and the least-squares v of J v = q.
    """
    problem = read_problem(find_problem(f"lcp/bowl.{number}.dynamics.lcp.gz")).problem
    values, axes = np.linalg.eigh(problem.delassus)
    kept = values > _NOISE * values[-1]
    rows = axes[:, kept] * np.sqrt(values[kept])
    return HardCase(f"Pile in a bowl, {what}", f"lcpy (Tournier), bowl.{number}.dynamics", why_hard, expected,
                    np.eye(int(kept.sum())), rows, np.linalg.lstsq(rows, problem.offset)[0], e)


def two_balls_and_a_wall() -> TrajectoryCase:
    """Two balls and a wall, nimblephysics issue 143, in which that engine doubled the energy."""
    given = json.loads(find_problem("nimble_143.json").read_text(encoding="utf-8"))
    speed = float(given["v"][0])
    balls = [ball(name, given["radius"], x, velocity=[v])
             for name, x, v in zip(("first", "second"), given["x"], given["v"], strict=True)]  # fmt: skip
    contact = {"restitution": given["e"], "coherence_distance": 5e-3}
    wall = {"name": "wall", "kind": "half_plane", "point": [given["wall"], 0.0], "normal": [-1.0, 0.0]}

    def measure(run: Run) -> Measured:
        """Measure the distance of the final velocities from those of the law, relative to the initial speed."""
        return Measured(largest_gain(run), NO_GAIN, float(np.abs(run.v[-1] - [-speed, 0.0]).max()) / speed, 1e-12)

    return TrajectoryCase(
        "Two balls and a wall, elastic", f"{given['source']}: {given['expected']}",
        "three elastic impacts within ten milliseconds; another engine doubled the energy",
        "the first ball returns at its own speed, the second rests", f"momentum and energy: v = (−{speed:g}, 0)",
        on_floor("two_balls_and_a_wall", "Two balls and a wall", balls, contact, duration=0.1, source=given["source"],
                 gravity=None, walls=[wall]), measure,
    )  # fmt: skip
