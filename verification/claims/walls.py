"""Claims on stiffness and damping of the walls: C17 (energy lost), C20 (bound on damping), C21
(stability)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from iapb.run import Run
from verification.check import Check, Study
from verification.claims.conditions import DAMPINGS, STIFFNESSES, Condition
from verification.claims.peg import place
from verification.finding import BEYOND
from verification.laws.engine import leak, penalty_wall, quickest_motion
from verification.region import Region
from verification.scenes.measures import colliding_rows
from verification.stability.walls import (
    PAPER_DAMPING,
    PENALTY,
    Floats,
    Loop,
    grid,
    loops,
    maps_of,
    touch_walls,
)
from verification.table import Row, Table

# C17: the energy lost on impact


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
    return condition.row("tilt", "stiffness", "damping") | {
        "impacts": len(lost),
        "lost in the first [J]": float(lost[0]) if len(lost) else None,
        "error": float(np.max(np.abs(lost - forms) / forms, initial=0.0)),
    }


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
    place="Section II",
    quantity="Largest difference between the energy lost in an impact and ½(1 − e²) vᵀJᵀW†Jv with the velocity v "
    "before the impact, relative to this form. J is made from the recorded contacts.",
    tolerance="1e-12 of the form, the rounding of some dozens of products.",
    cases=lambda study: [
        Condition(tilt, stiffness=stiffness, damping=damping)
        for tilt in (0.0, 0.1)
        for stiffness in STIFFNESSES
        for damping in DAMPINGS
    ],
    row=_losses,
    conditions=["tilt", "stiffness", "damping"],
    counts=["impacts"],
    holds=lambda row: bool(row["error"] <= 1e-12) if row["impacts"] else None,
    says=lambda table: (
        f"In {sum(table['impacts'])} impacts of {len(table.rows)} runs, the loss differs from the "
        f"form "
        f"½(1 − e²) vᵀJᵀW†Jv by at most {max(table['error']):.1e} of the form. The form contains "
        f"the velocity before the "
        "impact, the masses and the contacts, but no stiffness and no damping. Later impacts of a "
        "run start from "
        "velocities that the wall has changed; their losses depend on the wall only through these "
        "velocities."
    ),
    axes=("stiffness", "damping", "tilt"),
)


# C20: the bound on the virtual damping

WALL_STIFFNESSES = (250.0, 1000.0, 4000.0, 16000.0)
DEVICE_DAMPINGS = (
    0.0,
    0.5,
    1.25,
    2.0,
    5.0,
)  # times KT/2: below 1 no wall of this stiffness is passive
OF_BOUND = (0.0, 0.5, 0.95, 1.05, 2.0)  # times the bound b − KT/2
ROUNDING = 1e-11  # share of the turnover: the sums of 4000 steps, each rounded to 2e-16 of it
_STEPS = 2000


def _leak(study: Study, case: tuple[float, ...]) -> dict[str, Any]:
    """Return the row of one wall; its damping is a multiple of b − KT/2, or of KT/2 if b <=
    KT/2."""
    rate, K, device, share = case
    half = 0.5 * K / rate
    b = device * half
    B = share * (b - half if b > half else half)
    motion = quickest_motion(K, B, b, 1.0 / rate, _STEPS)
    turnover = (b + half + B) * float((np.diff(motion.positions) ** 2).sum()) * rate
    return {
        "rate [Hz]": rate,
        "stiffness [N/m]": K,
        "device damping [of KT/2]": device,
        "virtual damping [of the bound]": share if b > half else None,
        "energy from the wall [J]": leak(motion, penalty_wall),
        "wall's turnover [J]": turnover,
    }


def _leaks(row: Row) -> bool:
    return bool(row["energy from the wall"] > ROUNDING * row["wall's turnover"])


def _within(row: Row) -> bool:
    return row["virtual damping"] is not None and row["virtual damping"] <= 1.0


def _leak_says(table: Table) -> str:
    undamped = table.where(**{"device damping": 0.0})
    most, fed = max(undamped.column("energy from the wall")), sum(map(_leaks, undamped.records()))
    worst = max(
        row["energy from the wall"] / row["wall's turnover"]
        for row in table.records()
        if _within(row)
    )
    return (
        "At each wall we try the motion of the hand that draws the most energy. If the device "
        "damping b is at "
        f"least KT/2 + B, the hand draws at most {worst:.1g} of the wall's turnover. Otherwise it "
        f"draws energy as "
        "long as the motion lasts. Through a device without damping, as in the paper, the hand "
        "draws energy from "
        f"{fed} of {len(undamped.rows)} walls (up to {most:.2g} J in {_STEPS} samples)."
    )


C20 = Check(
    key="C20",
    question="Virtual damping is bounded by physical damping, stiffness and step: b > KT/2 + |B|.",
    place="Section VII, after Colgate and Schenkel",
    quantity="Energy that the hand draws from a wall of stiffness K and damping B, whose penalty force (5) is sampled "
    "every T and held, through a device of damping b. The motion to and fro at half the sampling "
    "rate, entirely inside "
    "the wall, draws most.",
    tolerance="1e-11 of the wall's turnover (b + KT/2 + B) Σ Δx²/T, where Δx is the motion in "
    "one sample: the rounding of the sums.",
    cases=lambda study: [
        (rate, stiffness, device, share)
        for rate in (512.0, 1000.0)
        for stiffness in WALL_STIFFNESSES
        for device in DEVICE_DAMPINGS
        for share in (OF_BOUND if device > 1.0 else (0.0, 1.0))
    ],
    row=_leak,
    holds=lambda row: _leaks(row) is not _within(row),
    says=_leak_says,
    conditions=["rate", "stiffness", "device damping", "virtual damping"],
    axes=("device damping", "stiffness"),
)


# C21: impulses against larger damping

SAME_DAMPING, EQUAL_GAIN, BOTH, TUNED = RIVALS = (
    "same damping, the paper's 50 N s/m",
    "penalties damped to the impulse's first force",
    "best damping of each law for each wall",
    "penalties at their best damping and impulses at the paper's",
)
WHEREVER, NO_LATER = TESTS = (
    "every wall that settles without impulses settles with them",
    "no wall settles later with impulses",
)
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
    (loop, stiffness), dampings = case, grid(study.depth)[1]
    raised = dampings[dampings >= PAPER_DAMPING]
    penalty, impulses = (
        one.settles_after[dampings >= PAPER_DAMPING] for one in maps_of(loop, stiffness, dampings)
    )
    best, ours_best = penalty.argmin(axis=0), impulses.argmin(axis=0)
    # the damping whose force at first contact equals the impulse's
    gain = (1.0 + loop.restitution) * loop.mass / loop.step
    sustained = touch_walls(loop, stiffness, np.array(gain), PENALTY).settles_after
    for i, K in enumerate(stiffness):
        paper, tuned = (
            (impulses[0, i], PAPER_DAMPING),
            (impulses[ours_best[i], i], raised[ours_best[i]]),
        )
        rival = penalty[best[i], i], raised[best[i]]
        rivals = {
            SAME_DAMPING: (paper, (penalty[0, i], PAPER_DAMPING)),
            EQUAL_GAIN: (paper, (sustained[i], gain)),
            BOTH: (tuned, rival),
            TUNED: (paper, rival),
        }
        for (against, ((ours, our_damping), (theirs, damping))), test in product(
            rivals.items(), TESTS
        ):
            yield {
                "against": against,
                "test": test,
                "rate [Hz]": loop.rate,
                "delay [samples]": loop.delay,
                "device damping [N s/m]": loop.device_damping,
                "stiffness [N/m]": float(K),
                "impulses settle after [s]": float(ours),
                "their damping [N s/m]": float(our_damping),
                "penalty settles after [s]": float(theirs),
                "at a damping of [N s/m]": float(damping),
            }


def _settles(row: Row) -> bool | None:
    """Return whether impulses settle where the rival does, or no later; None if the rival, or both,
    never settle."""
    ours, theirs = row["impulses settle after"], row["penalty settles after"]
    if row["test"] == WHEREVER:
        return bool(np.isfinite(ours)) if np.isfinite(theirs) else None
    return bool(ours <= theirs) if np.isfinite(min(ours, theirs)) else None


def _settling_says(table: Table) -> str:
    never, settle = {}, {}
    for rival in RIVALS:
        rows = table.where(against=rival, test=WHEREVER).records()
        ours, theirs = (
            np.isinf([row[f"{law} after"] for row in rows])
            for law in ("impulses settle", "penalty settles")
        )
        never[rival] = (
            f"{(theirs & ~ours).sum()} of {len(rows)} walls settle only with impulses and "
            f"{(ours & ~theirs).sum()} only with penalties"
        )
        settle[rival] = f"{(~theirs).sum()} of {len(rows)}"
    sooner = table.where(against=BOTH, test=NO_LATER).decided
    return (
        f"At the paper's damping of 50 N s/m, {never[SAME_DAMPING]}. At some other dampings, the "
        f"same for both, walls "
        "settle only with penalties; the page Stability of contact counts them. If penalties have "
        "the damping whose "
        f"force at first contact equals that of the impulse, {never[EQUAL_GAIN]}. The paper "
        f"prints that such a "
        "damping, sustained, “would cause the system to be stable”; its argument needs "
        "“unstable”. We test whether "
        f"impulses settle every wall that penalties with this damping settle "
        f"({settle[EQUAL_GAIN]} walls). Beyond the "
        f"paper: if penalties have the best damping for each wall and impulses 50 N s/m, "
        f"{never[TUNED]}. With the best "
        f"damping of each law for each wall, {never[BOTH]}, and impulses settle no later at "
        f"{sum(sooner)} of "
        f"{len(sooner)} walls. The paper says that no guidelines for the choice of a large "
        f"damping exist."
    )


C21 = Check(
    key="C21",
    question="Impulses make contact more stable than a sustained damping of the same gain.",
    place="Section VII",
    quantity="Settling time of a mass of 2 kg that the hand pushes against a sampled wall (“the wall settles”). The "
    "motion between samples is exact. Impulses at the paper's damping are compared with penalties "
    "at the same damping, "
    "and with penalties at the damping (1 + e) m/T, whose force at first contact equals that of "
    "the impulse (in the "
    "paper: equivalent gain). Beyond the paper: which law settles sooner; and penalties, or both "
    "laws, at the damping "
    "of at least 50 N s/m that settles each wall soonest, chosen afterwards.",
    tolerance="None: the mass settles within three seconds or not. A trial cannot tell if the mass settles with "
    "neither law; a trial of “every wall” cannot tell either if the mass does not settle without impulses.",
    roles={NO_LATER: BEYOND, BOTH: BEYOND, TUNED: BEYOND},
    cases=lambda study: [(loop, grid(study.depth)[0]) for loop in loops()],
    row=_settling,
    holds=_settles,
    says=_settling_says,
    draw=_draw,
    parts=["against", "test"],
    conditions=["rate", "delay", "device damping", "stiffness"],
    axes=("stiffness", "rate", "against"),
)
