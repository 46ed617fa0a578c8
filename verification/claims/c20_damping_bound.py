"""C20: physical damping, stiffness and step bound the virtual damping: b >= KT/2 + |B| (section VII)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from verification.claims.claim import Claim
from verification.finding import Column, Row, Table
from verification.laws.engine_laws.hand_port import leak, ours, quickest_motion

if TYPE_CHECKING:
    from verification.claims.study import Study

COLUMNS = (
    Column("rate", "Hz", condition=True),
    Column("stiffness", "N/m", condition=True),
    Column("device damping", "of KT/2", condition=True),
    Column("virtual damping", "of the bound", condition=True),
    Column("energy from the wall", "J"),
    Column("wall's turnover", "J"),
)

STIFFNESSES = (250.0, 1000.0, 4000.0, 16000.0)
DEVICE_DAMPINGS = (0.0, 0.5, 1.25, 2.0, 5.0)  # times KT/2: below 1 no wall of this stiffness is passive
DAMPINGS = (0.0, 0.5, 0.95, 1.05, 2.0)  # times the bound b − KT/2
ROUNDING = 1e-11  # share of the turnover: the sums of 4000 steps, each rounded to 2e-16 of it
_STEPS = 2000


def cases(study: Study) -> list[tuple[float, ...]]:
    """Walls on both sides of the bound; trials use the motion that gains most energy (`hand_port.quickest_motion`)."""
    return [
        (rate, stiffness, device, share)
        for rate in (512.0, 1000.0) for stiffness in STIFFNESSES for device in DEVICE_DAMPINGS
        for share in (DAMPINGS if device > 1.0 else (0.0, 1.0))
    ]  # fmt: skip


def trials(study: Study, case: tuple[float, ...]) -> Iterator[dict[str, Any]]:
    """Yield the trial of one wall; its damping is a multiple of b − KT/2, or of KT/2 if b <= KT/2."""
    rate, K, device, share = case
    half = 0.5 * K / rate
    b = device * half
    B = share * (b - half if b > half else half)
    motion = quickest_motion(K, B, b, 1.0 / rate, _STEPS)
    turnover = (b + half + B) * float(((motion.readings[1:] - motion.readings[:-1]) ** 2).sum()) * rate
    yield {
        "rate": rate, "stiffness": K, "device damping": device, "virtual damping": share if b > half else None,
        "energy from the wall": leak(motion, ours), "wall's turnover": turnover,
    }  # fmt: skip


def holds(row: Row) -> bool:
    """Return whether energy comes out of a wall beyond the bound, or no energy comes out of a wall within it."""
    leaks = row["energy from the wall"] > ROUNDING * row["wall's turnover"]
    share = row["virtual damping"]
    allowed = share is not None and share <= 1.0
    return bool(leaks is not allowed)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    within = [row for row in table.records() if row["virtual damping"] is not None and row["virtual damping"] <= 1.0]
    undamped = table.where(**{"device damping": 0.0})
    most = max(undamped.column("energy from the wall"))
    fed = sum(e > ROUNDING * t for e, t in zip(undamped.column("energy from the wall"),
                                               undamped.column("wall's turnover"), strict=True))  # fmt: skip
    worst = max(row["energy from the wall"] / row["wall's turnover"] for row in within)
    return (f"If b >= KT/2 + B, the hand draws at most {worst:.0e} of the energy exchanged from a wall; otherwise it "
            f"can draw energy without limit. The paper's device has no damping: it gains energy at {fed} of "
            f"{len(undamped.rows)} walls (up to {most:.2g} J in {_STEPS} samples), so its contacts are stable only "
            "because of the hand and the coupling.")


CLAIM = Claim(
    id="C20",
    statement="Virtual damping is bounded by physical damping, stiffness and step: b > KT/2 + |B|.",
    place="Section VII, after Colgate and Schenkel",
    quantity="Energy that the hand draws from the engine's penalty force (5), sampled with period T and held, by the "
    "motion that draws most: to and fro at half the sampling rate, entirely inside the wall.",
    tolerance="1e-11 of the energy exchanged (the wall's turnover): the rounding of the sums.",
    columns=COLUMNS,
    cases=cases,
    trials=trials,
    holds=holds,
    finding=finding,
    axes=("device damping", "stiffness"),
)
