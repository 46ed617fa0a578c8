"""Claims on stiffness and damping of the walls: C17 (energy lost), C20 (bound on damping), C21 (stability)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from verification.check import Check, Study
from verification.claims.conditions import DAMPINGS, STIFFNESSES, Condition
from verification.claims.peg import trace
from verification.finding import BEYOND
from verification.laws.engine import leak, penalty_wall, quickest_motion
from verification.region import Region
from verification.scenes.measures import Trace
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

FIRST, ALL = "the first impact", "all impacts of the run"
# No wall has acted before the first impact, so its state is the same for all walls; only the energy's rounding differs.
SAME = 1e-12
SHORTLY = 0.020  # [s] after first contact: about the time that a penalty force needs to stop the peg


def _losses(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield the rows of one wall, compared with the paper's wall."""
    default = Condition()
    reference = replace(condition, stiffness=default.stiffness, damping=default.damping)
    ours, theirs = trace(study, condition, "IAPB"), trace(study, reference, "IAPB")
    shortly = _lost_shortly(trace(study, condition, "PB"))
    losses = {FIRST: (_first_loss(ours), _first_loss(theirs))}
    if condition != reference:
        losses[ALL] = float(ours.energy_lost.sum()), float(theirs.energy_lost.sum())
    for part, (lost, other) in losses.items():
        yield {"part": part, **condition.row("tilt", "stiffness", "damping"), "lost [J]": lost,
               "of the reference [J]": other, "PB, lost within 20 ms [J]": shortly}  # fmt: skip


def _first_loss(trace: Trace) -> float:
    return float(trace.energy_lost[0]) if len(trace.energy_lost) else 0.0


def _lost_shortly(trace: Trace) -> float:
    """Kinetic energy of the tool at first contact minus that SHORTLY later [J]."""
    start = min(trace.first_contact, len(trace.time) - 1)
    end = min(start + round(SHORTLY / trace.dt), len(trace.time) - 1)
    return float(trace.kinetic_energy[start] - trace.kinetic_energy[end])


def _loss_holds(row: Row) -> bool | None:
    """Return whether the loss equals that at the reference walls; None if the reference has no impact."""
    lost, reference = row["lost"], row["of the reference"]
    return bool(abs(lost - reference) <= SAME * reference) if reference > 0.0 else None


def _losses_say(table: Table) -> str:
    texts = []
    for tilt in dict.fromkeys(table.column("tilt")):
        first, every = (table.where(tilt=tilt, part=part) for part in (FIRST, ALL))
        losses, reference = np.array(first.column("lost")), first.column("of the reference")[0]
        total = [1e3 * pick(every.column("lost")) for pick in (min, max)]
        penalty = [1e3 * pick(first.column("PB, lost within 20 ms")) for pick in (min, max)]
        texts.append(
            f"At a tilt of {tilt:g} rad the first impact takes {1e3 * reference:.4g} mJ; it varies by "
            f"{np.ptp(losses) / reference:.0e} of this between walls. All impacts of a run together take "
            f"{total[0]:.3g} to {total[1]:.3g} mJ, depending on the wall. PB takes {penalty[0]:.2g} to "
            f"{penalty[1]:.3g} mJ in 20 ms from contact on."
        )
    return (f"{' '.join(texts)} The claim is about one collision. The sum over all impacts goes beyond the claim, "
            "because later impacts start from states that the walls have changed.")


C17 = Check(
    key="C17", question="The energy lost on impact does not depend on contact stiffness and damping.",
    place="Section II",
    quantity="Kinetic energy lost in the first impact, and in all impacts of the run, compared with that at the "
    "paper's walls. The table also has the energy that PB takes.",
    tolerance="1e-12 of the loss. The state before the first impact is the same to the last bit for all walls. So the "
    "loss must be the same as well if it does not depend on the walls.",
    cases=lambda study: [Condition(tilt, stiffness=stiffness, damping=damping) for tilt in (0.0, 0.1)
                         for stiffness in STIFFNESSES for damping in DAMPINGS],
    row=_losses, holds=_loss_holds, says=_losses_say, parts=["part"], conditions=["tilt", "stiffness", "damping"],
    roles={ALL: BEYOND},
    axes=("stiffness", "damping", "part"),
)  # fmt: skip


# C20: the bound on the virtual damping

WALL_STIFFNESSES = (250.0, 1000.0, 4000.0, 16000.0)
DEVICE_DAMPINGS = (0.0, 0.5, 1.25, 2.0, 5.0)  # times KT/2: below 1 no wall of this stiffness is passive
OF_BOUND = (0.0, 0.5, 0.95, 1.05, 2.0)  # times the bound b − KT/2
ROUNDING = 1e-11  # share of the turnover: the sums of 4000 steps, each rounded to 2e-16 of it
_STEPS = 2000


def _leak(study: Study, case: tuple[float, ...]) -> dict[str, Any]:
    """Return the row of one wall; its damping is a multiple of b − KT/2, or of KT/2 if b <= KT/2."""
    rate, K, device, share = case
    half = 0.5 * K / rate
    b = device * half
    B = share * (b - half if b > half else half)
    motion = quickest_motion(K, B, b, 1.0 / rate, _STEPS)
    turnover = (b + half + B) * float((np.diff(motion.positions) ** 2).sum()) * rate
    return {
        "rate [Hz]": rate, "stiffness [N/m]": K, "device damping [of KT/2]": device,
        "virtual damping [of the bound]": share if b > half else None,
        "energy from the wall [J]": leak(motion, penalty_wall), "wall's turnover [J]": turnover,
    }  # fmt: skip


def _leaks(row: Row) -> bool:
    return bool(row["energy from the wall"] > ROUNDING * row["wall's turnover"])


def _within(row: Row) -> bool:
    return row["virtual damping"] is not None and row["virtual damping"] <= 1.0


def _leak_says(table: Table) -> str:
    undamped = table.where(**{"device damping": 0.0})
    most, fed = max(undamped.column("energy from the wall")), sum(map(_leaks, undamped.records()))
    worst = max(row["energy from the wall"] / row["wall's turnover"] for row in table.records() if _within(row))
    return (f"If the device damping b is at least KT/2 + B, the hand draws at most {worst:.0e} of the energy exchanged "
            "from a wall. Otherwise the hand can draw energy without limit. A device without damping, as in the paper, "
            f"draws energy from {fed} of {len(undamped.rows)} walls (up to {most:.2g} J in {_STEPS} samples). Its "
            "contacts are stable only because of the hand and the coupling.")


C20 = Check(
    key="C20", question="Virtual damping is bounded by physical damping, stiffness and step: b > KT/2 + |B|.",
    place="Section VII, after Colgate and Schenkel",
    quantity="Energy that the hand draws from the engine's penalty force (5), sampled with period T and held, by the "
    "motion that draws most: to and fro at half the sampling rate, entirely inside the wall.",
    tolerance="1e-11 of the energy exchanged (the wall's turnover): the rounding of the sums.",
    cases=lambda study: [
        (rate, stiffness, device, share) for rate in (512.0, 1000.0) for stiffness in WALL_STIFFNESSES
        for device in DEVICE_DAMPINGS for share in (OF_BOUND if device > 1.0 else (0.0, 1.0))
    ],
    row=_leak, holds=lambda row: _leaks(row) is not _within(row), says=_leak_says,
    conditions=["rate", "stiffness", "device damping", "virtual damping"], axes=("device damping", "stiffness"),
)  # fmt: skip


# C21: impulses against larger damping

SAME_DAMPING, EQUAL_GAIN, BOTH, BOTH_SOONER, TUNED = RIVALS = (
    "same damping: impulses settle no later", "penalty damping that gives the same force: impulses settle no later",
    "best damping of each law for each wall: impulses settle wherever penalties do",
    "best damping of each law for each wall: impulses settle no later",
    "penalties at their best damping, impulses at the paper's: impulses settle no later",
)
FRESH = 5  # number of walls per loop drawn to confirm a region
Case = tuple[Loop, Floats]  # and the stiffnesses of its walls


def _draw(study: Study, region: Region) -> Iterator[Case]:
    """Draw fresh walls inside a region for every loop, uniformly in the logarithm of the stiffness."""
    low, high = region.ends("stiffness", grid(study.depth)[0].tolist())
    rng = np.random.default_rng(study.seed)
    for loop in loops():
        yield loop, np.array([float(f"{low * (high / low) ** share:.4g}") for share in rng.random(FRESH)])


def _settling(study: Study, case: Case) -> Iterator[Row]:
    """Yield the rows of the walls of one loop: impulses against penalties, at given dampings and at the best ones."""
    (loop, stiffness), dampings = case, grid(study.depth)[1]
    raised = dampings[dampings >= PAPER_DAMPING]
    penalty, impulses = (one.settles_after[dampings >= PAPER_DAMPING] for one in maps_of(loop, stiffness, dampings))
    best, ours_best = penalty.argmin(axis=0), impulses.argmin(axis=0)
    # the damping whose force at first contact equals the impulse's
    gain = (1.0 + loop.restitution) * loop.mass / loop.step
    sustained = touch_walls(loop, stiffness, np.array(gain), PENALTY).settles_after
    for i, K in enumerate(stiffness):
        paper, tuned = (impulses[0, i], PAPER_DAMPING), (impulses[ours_best[i], i], raised[ours_best[i]])
        rival = penalty[best[i], i], raised[best[i]]
        rivals = {SAME_DAMPING: (paper, (penalty[0, i], PAPER_DAMPING)), EQUAL_GAIN: (paper, (sustained[i], gain)),
                  BOTH: (tuned, rival), BOTH_SOONER: (tuned, rival), TUNED: (paper, rival)}  # fmt: skip
        for against, ((ours, our_damping), (theirs, damping)) in rivals.items():
            yield {
                "against": against, "rate [Hz]": loop.rate, "delay [samples]": loop.delay,
                "device damping [N s/m]": loop.device_damping, "stiffness [N/m]": float(K),
                "impulses settle after [s]": float(ours), "their damping [N s/m]": float(our_damping),
                "penalty settles after [s]": float(theirs), "at a damping of [N s/m]": float(damping),
            }  # fmt: skip


def _settles(row: Row) -> bool | None:
    """Return whether impulses settle no later than the rival penalty, or at all; None if neither settles."""
    ours, theirs = row["impulses settle after"], row["penalty settles after"]
    if np.isinf(ours) and np.isinf(theirs):
        return None
    return bool(np.isfinite(ours) if row["against"] == BOTH else ours <= theirs)


def _settling_says(table: Table) -> str:
    never = {}
    for rival in RIVALS:
        rows = table.where(against=rival).records()
        ours, theirs = (np.isinf([row[f"{law} after"] for row in rows])
                        for law in ("impulses settle", "penalty settles"))  # fmt: skip
        never[rival] = (f"{(theirs & ~ours).sum()} walls settle only with impulses and {(ours & ~theirs).sum()} only "
                        "with penalties")  # fmt: skip
    sooner = table.where(against=BOTH_SOONER).decided
    return (
        f"At the paper's damping of 50 N s/m, {never[SAME_DAMPING]}. If the penalties' damping gives the force of the "
        f"impulse, {never[EQUAL_GAIN]}. With the best damping of each law for each wall, {never[BOTH]}. Beyond the "
        f"paper: with these best dampings, impulses settle no later than penalties at {sum(sooner)} of {len(sooner)} "
        "walls. The paper does not claim this; it says that there are no guidelines for a large stable damping."
    )


C21 = Check(
    key="C21", question="Impulse forces make contact more stable than raising the damping does.", place="Section VII",
    quantity="Settling time of a mass of 2 kg that the hand pushes against a sampled wall; its motion between samples "
    "is exact. Impulses at the paper's damping are compared with penalties at the same damping, and with penalties at "
    "the damping (1 + e) m/T, whose force at first contact equals that of the impulse (in the paper: equivalent gain). "
    "Then each law gets its best damping of at least 50 N s/m for each wall, chosen afterwards; the mass must settle "
    "with impulses wherever it settles with penalties. Beyond the paper: which law settles sooner at such dampings.",
    tolerance="None: the law with the smaller time wins. A trial cannot tell if the mass settles with neither law.",
    roles={BOTH_SOONER: BEYOND, TUNED: BEYOND},
    cases=lambda study: [(loop, grid(study.depth)[0]) for loop in loops()], row=_settling, holds=_settles,
    says=_settling_says, draw=_draw, parts=["against"],
    conditions=["rate", "delay", "device damping", "stiffness"], axes=("stiffness", "rate", "against"),
)  # fmt: skip
