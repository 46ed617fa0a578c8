"""Claims on stiffness and damping of the walls: C17 (energy lost), C20 (bound on damping), C21
(stability)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from iapb.run import Run
from verification.check import Check, Study
from verification.claims.conditions import DAMPINGS, STIFFNESSES, Condition
from verification.claims.peg import place
from verification.finding import BEYOND
from verification.port.baselines.penalty import PenaltyWall
from verification.port.device import BareDevice
from verification.port.kit import check_force
from verification.region import Region
from verification.scenes.measures import colliding_rows
from verification.stability.walls import (
    IMPULSES,
    PAPER_DAMPING,
    PENALTY,
    Floats,
    Loop,
    grid,
    loops,
    touch_walls,
)
from verification.table import Columns, Row

# C17: the energy lost on impact

ROUNDING_OF_LOSS = 1e-12  # of the form: the rounding of some dozens of products


def _losses(study: Study, condition: Condition) -> Row:
    """Compare the loss in every impact at one wall with the form of its own velocity."""
    scene = place(study, condition)
    run = study.run(scene, "IAPB", "full")
    lost = run.impacts.energy_lost
    forms = (
        0.5
        * (1.0 - float(scene.contact.restitution) ** 2)
        * np.array(
            [
                _form(run, *impact)
                for impact in zip(run.impacts.step, run.impacts.v_minus, strict=True)
            ]
        )
    )
    return (
        {"part": "loss"}
        | condition.row("tilt", "stiffness", "damping")
        | {
            "impacts": len(lost),
            "error": float(np.max(np.abs(lost - forms) / forms, initial=0.0)),
        }
    )


def _form(run: Run, step: int, v: Floats) -> float:
    """vᵀJᵀW†Jv of the contacts that collide."""
    body = run.scene_resolved["bodies"][0]
    root = np.sqrt([body["mass"], body["mass"], body["inertia"]])
    whitened = colliding_rows(run, step, v) / root
    change = np.linalg.lstsq(whitened, whitened @ (root * v), rcond=1e-9)[0]
    return float(change @ change)


C17 = Check(
    key="C17",
    question="The energy lost on impact does not depend on contact stiffness and damping.",
    cases=lambda study: [
        Condition(tilt, stiffness=stiffness, damping=damping)
        for tilt in (0.0, 0.1)
        for stiffness in STIFFNESSES
        for damping in DAMPINGS
    ],
    row=_losses,
    columns=Columns(conditions=("tilt", "stiffness", "damping"), parts=("part",)),
    holds=lambda row: bool(row["error"] <= ROUNDING_OF_LOSS) if row["impacts"] else None,
    roles={"loss": "loss_without_stiffness"},
)


# C20: the bound on the virtual damping

WALL_STIFFNESSES = (250.0, 1000.0, 4000.0, 16000.0)
# times KT/2: below 1 no wall of this stiffness is passive
DEVICE_DAMPINGS = (0.0, 0.5, 1.25, 2.0, 5.0)
OF_BOUND = (0.0, 0.5, 0.95, 1.05, 2.0)  # times the bound b − KT/2
EFFORT = 0.1  # of the search of each wall


def _needs(study: Study, case: tuple[float, ...]) -> dict[str, Any]:
    """Return the row of one wall; its damping is a multiple of b − KT/2, or of KT/2 if b <=
    KT/2."""
    rate, K, device, share = case
    half = 0.5 * K / rate
    b = device * half
    B = share * (b - half if b > half else half)
    report = check_force(
        PenaltyWall(K, B), BareDevice(rate, b), laws=["energy"], effort=EFFORT, seed=study.seed
    )
    return {
        "rate [Hz]": rate,
        "stiffness [N/m]": K,
        "device damping [of KT/2]": device,
        "virtual damping [of the bound]": share if b > half else None,
        "hand draws energy": not report.passed,
    }


def _within(row: Row) -> bool:
    return row["virtual damping"] is not None and row["virtual damping"] <= 1.0


C20 = Check(
    key="C20",
    question="Virtual damping is bounded by physical damping, stiffness and step: b > KT/2 + |B|.",
    cases=lambda study: [
        (rate, stiffness, device, share)
        for rate in (512.0, 1000.0)
        for stiffness in WALL_STIFFNESSES
        for device in DEVICE_DAMPINGS
        for share in (OF_BOUND if device > 1.0 else (0.0, 1.0))
    ],
    row=_needs,
    holds=lambda row: row["hand draws energy"] is not _within(row),
    columns=Columns(conditions=("rate", "stiffness", "device damping", "virtual damping")),
)


# C21: impulses against larger damping

SAME_DAMPING = "same damping"
EQUAL_GAIN = "same first force"
BOTH = "best damping of each law"
SETTLES = "settles where springs do"
SOONER = "settles no later"
FRESH = 5  # number of walls per loop drawn to confirm a region
Case = tuple[Loop, Floats]  # and the stiffnesses of its walls


def _draw(study: Study, region: Region) -> Iterator[Case]:
    """Draw fresh walls inside a region for every loop, uniformly in the logarithm of the
    stiffness."""
    low, high = region.ends("stiffness", grid(study.depth)[0].tolist())
    rng = np.random.default_rng(study.seed)
    for loop in loops():
        yield (
            loop,
            np.array([float(f"{low * (high / low) ** share:.4g}") for share in rng.random(FRESH)]),
        )


def _settling(study: Study, case: Case) -> Iterator[Row]:
    """Yield the rows of the walls of one loop: impulses against penalties, at given dampings and at
    the best ones."""
    (loop, stiffness) = case
    dampings = grid(study.depth)[1]
    raised = dampings[dampings >= PAPER_DAMPING]
    penalty, impulses = (
        touch_walls(loop, stiffness, raised[:, None], law) for law in (PENALTY, IMPULSES)
    )
    # the damping whose force at first contact equals the impulse's
    gain = (1.0 + loop.restitution) * loop.mass / loop.step
    sustained = touch_walls(loop, stiffness, np.array(gain), PENALTY)
    best = penalty.min(axis=0)
    ours_best = impulses.min(axis=0)
    rivals = (
        (SAME_DAMPING, SETTLES, impulses[0], penalty[0]),
        (EQUAL_GAIN, SETTLES, impulses[0], sustained),
        (BOTH, SETTLES, ours_best, best),
        (BOTH, SOONER, ours_best, best),
    )
    for i, K in enumerate(stiffness):
        for against, test, ours, theirs in rivals:
            yield {
                "against": against,
                "test": test,
                "rate [Hz]": loop.rate,
                "delay [samples]": loop.delay,
                "device damping [N s/m]": loop.device_damping,
                "stiffness [N/m]": float(K),
                "impulses settle after [s]": float(ours[i]),
                "penalty settles after [s]": float(theirs[i]),
            }


def _settles(row: Row) -> bool | None:
    """Return whether impulses settle where springs do, or no later; None if springs do not settle,
    or for equal times."""
    ours = row["impulses settle after"]
    theirs = row["penalty settles after"]
    if row["test"] == SETTLES:
        return bool(np.isfinite(ours)) if np.isfinite(theirs) else None
    return None if ours == theirs else bool(ours < theirs)


C21 = Check(
    key="C21",
    question="Impulses make contact more stable than a sustained damping of the same gain.",
    roles={BOTH: BEYOND},
    cases=lambda study: [(loop, grid(study.depth)[0]) for loop in loops()],
    row=_settling,
    holds=_settles,
    draw=_draw,
    columns=Columns(
        parts=("against", "test"), conditions=("rate", "delay", "device damping", "stiffness")
    ),
)
