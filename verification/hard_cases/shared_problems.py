"""Hard problems by others, from the folder ../shared/problems next to the project; absent files raise CaseAbsent."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from iapb.run import Run
from iapb.scene import scene_from_text
from reference.datasets import read_problem
from verification.hard_cases.case import NO_GAIN, CaseAbsent, HardCase, Measured, TrajectoryCase, largest_gain

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "problems"
_NOISE = 1e-10  # share of the largest eigenvalue of W; smaller eigenvalues in these files are rounding noise


def find_problem(place: str) -> Path:
    """Return the path of a file of the folder, or raise CaseAbsent with its name."""
    path = FOLDER / place
    if not path.is_file():
        raise CaseAbsent(f"needs ../shared/problems/{place} beside the project")
    return path


def bowl_of_low_rank() -> HardCase:
    """bowl.5: 35 contacts of rank five."""
    mass, rows, velocity = _mechanics("lcp/bowl.5.dynamics.lcp.gz")
    return HardCase(
        "Pile in a bowl, 35 contacts of rank 5", "lcpy (Tournier), bowl.5.dynamics",
        "35 contacts have rank 5; the five singular values range from 0.003 to 2", "rank 5, exactly plastic",
        mass, rows, velocity, 0.0,
    )  # fmt: skip


def bowl_of_mixed_scales() -> HardCase:
    """bowl.21: the eigenvalues of W range from 2e-4 to 4e5."""
    mass, rows, velocity = _mechanics("lcp/bowl.21.dynamics.lcp.gz")
    return HardCase(
        "Pile in a bowl, 43 contacts of mixed scales", "lcpy (Tournier), bowl.21.dynamics",
        "one direction is a "
        "million times lighter than the others, so its rounding hides them", "all directions are found",
        mass, rows, velocity, 0.5,
    )  # fmt: skip


def _mechanics(place: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M = 1, rows J with J Jᵀ = W up to the noise of the file, and the least-squares solution v of J v = q."""
    problem = read_problem(find_problem(place)).problem
    values, axes = np.linalg.eigh(problem.delassus)
    kept = values > _NOISE * values[-1]
    rows = axes[:, kept] * np.sqrt(values[kept])
    velocity = np.linalg.lstsq(rows, problem.offset)[0]
    return np.eye(int(kept.sum())), rows, velocity


_BALLS = """
name: two_balls_and_a_wall
title: Two balls and a wall
source: {source}
rate: 1000
duration: 0.1
bodies:
  - {{name: first, joint: prismatic, axis: [1, 0], mass: 1.0, shapes: [{{kind: circle, radius: {radius}}}],
     position: [{x[0]}], velocity: [{v[0]}]}}
  - {{name: second, joint: prismatic, axis: [1, 0], mass: 1.0, shapes: [{{kind: circle, radius: {radius}}}],
     position: [{x[1]}], velocity: [{v[1]}]}}
walls:
  - {{name: wall, kind: half_plane, point: [{wall}, 0], normal: [-1, 0]}}
contact: {{forces: paper, restitution: {e}, coherence_distance: 5e-3}}
"""


def two_balls_and_a_wall() -> TrajectoryCase:
    """Two balls and a wall, nimblephysics issue 143, in which that engine doubled the energy."""
    given = json.loads(find_problem("nimble_143.json").read_text(encoding="utf-8"))
    text = _BALLS.format(**given)
    speed = float(given["v"][0])

    def measure(run: Run) -> Measured:
        """Measure the distance of the final velocities from those of the law, relative to the initial speed."""
        return Measured(largest_gain(run), NO_GAIN, float(np.abs(run.v[-1] - [-speed, 0.0]).max()) / speed, 1e-12)

    return TrajectoryCase(
        "Two balls and a wall, elastic", f"{given['source']}: {given['expected']}",
        "three elastic impacts within ten milliseconds; another engine doubled the energy",
        "the first ball returns at its own speed, the second rests", f"momentum and energy: v = (−{speed:g}, 0)",
        scene_from_text(text), measure,
    )  # fmt: skip
