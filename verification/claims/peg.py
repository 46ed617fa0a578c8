"""Claims on the peg in the corner, C10 to C16: IAPB against ideal, PB and CBuc, with and without device limits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from iapb.scene import Scene
from verification.check import Check, Study
from verification.claims.conditions import (
    EVEN_TILTS,
    FULL_GRID,
    START,
    UNITS,
    Condition,
    drawn,
    limited_conditions,
    start_conditions,
)
from verification.finding import BEYOND
from verification.region import Region
from verification.scenes.measures import (
    COORDINATES,
    Trace,
    bounces,
    comparison_window,
    deepest_penetration,
    force_distance,
    largest_distance,
    largest_separation,
    peak_force,
    resting_force,
    root_mean_square,
    settling_time,
    share_limited,
    trace_of,
)
from verification.table import Row, Table

# Number of fresh starts that confirm a region. If a tenth of its starts fail, a region is confirmed once in 24 times.
FRESH = 30
# Neither a hand nor a figure shows distances below this [m, rad] (a tenth of a micrometre). A trial decides nothing in
# a coordinate in which every rendering is that close to the unlimited device, as the angle of a peg that lies flat.
INDISTINGUISHABLE = 1e-7
# The ideal world's own error of discretisation [m, rad]: its RMS distance from the ideal world at four times the rate
# is 1.9e-5 to 2.8e-5 m in x, 3.4e-5 to 5.4e-5 m in y and 3.8e-3 to 5.5e-3 rad (median and 90 % of 48 starts). If IAPB
# and the nearer rival differ by less, a trial cannot tell which is closer to a rigid wall.
ALL_THREE = "together"
ARM = 0.05  # [m] √(inertia / mass) of the peg: the length of (x, y, θ) in the kinetic metric is √(x² + y² + (ARM θ)²)
RESOLVED = {"x": 2.5e-5, "y": 5e-5, "theta": 5e-3}
RESOLVED[ALL_THREE] = float(np.linalg.norm([RESOLVED["x"], RESOLVED["y"], ARM * RESOLVED["theta"]]))
NAMED = {"x": "x", "y": "y", "theta": "rotation", ALL_THREE: "all three together"}
LIMITED = (*START, "force_limit")
CANNOT_TELL = (
    "A trial cannot tell if the distances of IAPB and of its nearer rival differ by less than the time step's error "
    "in the ideal world: 2.5e-5 m in x, 5e-5 m in y, 5e-3 rad in theta, 2.6e-4 m together."
)
WORLDS = ("IAPB", "PB", "CBuc")
RENDERINGS = ("saturate", "scale", "spread")


def place(study: Study, condition: Condition) -> Scene:
    """Return the peg scene under a condition."""
    return study.once(condition, lambda: condition.place(study.scene("peg_corner")))


def trace(study: Study, condition: Condition, world: str, rendering: str = "full") -> Trace:
    """Return the trace of the peg; conditions that differ only in values the world ignores share one run."""
    seen = condition.seen_by(world, rendering)
    wanted = place(study, seen), world, rendering
    if study.asked is not None:
        study.asked(*wanted)
    return study.once((seen, world, rendering), lambda: trace_of(study.run(*wanted)))


def peg_claim(key: str, question: str, *, limited: bool = False, **words: Any) -> Check:
    """Return a claim on every start of the peg, with device limits or without; `words` are other fields of Check.

    To confirm a region, FRESH starts are drawn inside it.
    """

    def cases(study: Study) -> tuple[Condition, ...]:
        return (limited_conditions if limited else start_conditions)(study.depth)

    def draw(study: Study, region: Region) -> list[Condition]:
        return drawn(cases(study), region, study.seed, FRESH)

    common: dict[str, Any] = {"cases": cases, "draw": draw, "conditions": tuple(UNITS), "named": NAMED}
    return Check(key=key, question=question, **common | words)


def closest(row: Row) -> bool | None:
    """Return whether IAPB is nearer to ideal (RMS) than PB and CBuc; None if ideal is not known well enough to tell."""
    ahead = min(row["PB"], row["CBuc"]) - row["IAPB"]
    return None if abs(ahead) < RESOLVED[row["coordinate"]] else bool(ahead > 0.0)


def distances(study: Study, condition: Condition, rendering: str) -> Iterator[dict[str, Any]]:
    """Yield per coordinate the RMS and the largest distance of each world from ideal, then the RMS of all three."""
    ideal = trace(study, condition, "ideal")
    worlds = {name: trace(study, condition, name, rendering if name == "IAPB" else "full") for name in WORLDS}
    window = comparison_window([ideal, *worlds.values()])
    rms = {name: root_mean_square(one, ideal, window) for name, one in worlds.items()}
    found = rms | {f"{name}, largest": largest_distance(one, ideal, window) for name, one in worlds.items()}
    for i, coordinate in enumerate(COORDINATES):
        yield {"coordinate": coordinate} | {name: float(values[i]) for name, values in found.items()}
    yield {"coordinate": ALL_THREE} | {name: float(np.linalg.norm(one * (1.0, 1.0, ARM))) for name, one in rms.items()}


def _ratios_to_pb(table: Table) -> str:
    """Return the median of distance(IAPB) / distance(PB) over the decided rows of each coordinate, in words."""
    rows = [row for row, held in zip(table.records(), table.holds, strict=True) if held is not None]
    return ", ".join(f"{_median(row['IAPB'] / row['PB'] for row in rows if row['coordinate'] == name):.2f} in {named}"
                     for name, named in NAMED.items())  # fmt: skip


def _median(values: Iterable[float]) -> float:
    found = list(values)
    return float(np.median(found)) if found else np.nan


# C10: the trajectory. With the paper's threshold every approaching contact collides. Larger thresholds are ours.

PAPERS = Condition().approach_velocity
LARGER = "if only faster contacts collide"


def _all_starts(study: Study) -> tuple[Condition, ...]:
    return tuple(dict.fromkeys((*start_conditions(study.depth), *FULL_GRID)))


def slowest_runs(study: Study) -> Iterator[tuple[Scene, str]]:
    """Yield scene and world of the runs of C10 that take longest, the last first, for a process beside the claims."""
    for start in dict.fromkeys(start.seen_by("ideal", "full") for start in reversed(_all_starts(study))):
        for world in ("ideal", "CBuc"):
            yield place(study, start), world


def _trajectory(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield one row per coordinate and one for all three together; the part is the coordinate, and LARGER if so."""
    larger = f", {LARGER}" if condition.approach_velocity > PAPERS else ""
    for row in distances(study, condition, "full"):
        yield {"part": f"{row['coordinate']}{larger}"} | condition.row() | row


def _draw_twice(study: Study, region: Region) -> list[Condition]:
    """Draw fresh starts; each appears twice, with the paper's approach velocity and with the drawn one."""
    found = drawn(_all_starts(study), region, study.seed, FRESH)
    return [*(replace(start, approach_velocity=PAPERS) for start in found), *found]


def closest_at(table: Table, tilts: Iterable[float]) -> dict[str, tuple[int, int]]:
    """Return for each quantity of C10 the starts with these tilts in which IAPB is closest, and those that can tell."""
    rows = table.only(tilt in tilts for tilt in table["tilt"])
    decided = {name: rows.where(part=name).decided for name in (*COORDINATES, ALL_THREE)}
    return {name: (sum(found), len(found)) for name, found in decided.items()}


def small_tilts(table: Table) -> set[float]:
    """Return the tilts of a table up to that of the scene."""
    return {tilt for tilt in table["tilt"] if tilt <= Condition().tilt}


def _trajectory_says(table: Table) -> str:
    def counts(tilts: Iterable[float]) -> str:
        found = closest_at(table, tilts)
        return ", ".join(f"{held} of {told} in {NAMED[name]}" for name, (held, told) in found.items())

    papers = table.only(part in NAMED for part in table["part"])
    return (
        f"Of the starts that can tell, IAPB is closest in {counts(table['tilt'])} (in the kinetic "
        f"metric). The counts depend on the tilt. Tilts up to {Condition().tilt:g} rad: {counts(small_tilts(table))}. "
        f"Evenly spaced tilts: {counts(EVEN_TILTS)}. The distance of IAPB to ideal, divided by that of PB, has these "
        f"medians: {_ratios_to_pb(papers)}."
    )


C10 = peg_claim(
    "C10", "The device trajectory of IAPB is closest to ideal, ahead of PB and CBuc.",
    place="Section VI, Fig. 7",
    quantity="RMS distance of the device trajectory from that of the ideal world, per coordinate and for all three "
    "together, √(x² + y² + (0.05 m θ)²), from the first contact until all four worlds have settled or the run ends. "
    "The table also has the largest distance. A contact collides if it approaches faster than a threshold, the "
    "approach velocity. At 1e-6 m/s every approaching contact collides, as in the paper; larger thresholds are ours.",
    tolerance=f"IAPB's distance is the smallest of the three. {CANNOT_TELL}",
    cases=_all_starts, row=_trajectory, draw=_draw_twice, holds=closest, says=_trajectory_says, parts=("part",),
    roles={LARGER: BEYOND}, axes=("tilt", "clearance", "part"),
)  # fmt: skip


# C11: the forces

LARGE, BALANCE = "peak on new contact", "mean force after settling"
CLOSEST, CLOSEST_RMS = "force, mean distance to ideal", "force, RMS distance to ideal"
# At 1 mm/s, the largest speed that counts as settled, the dampers carry 50 N s/m x 1 mm/s = 0.05 N of the hand's 0.4 N.
BALANCED = 0.05  # [N]
# Peaks and distances below this [N, N m] are rounding: no force acts along this coordinate.
NOTHING = 1e-9


def _forces(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield per coordinate the peak forces, the distances of the forces, and the resting forces."""
    ideal = trace(study, condition, "ideal")
    traces = {world: trace(study, condition, world) for world in WORLDS}
    window = comparison_window([ideal, *traces.values()])
    measures: dict[str, Callable[[Trace], Any]] = {
        LARGE: peak_force, CLOSEST: lambda one: force_distance(one, ideal, window, 1),
        CLOSEST_RMS: lambda one: force_distance(one, ideal, window, 2), BALANCE: resting_force,
    }  # fmt: skip
    found = {part: {world: measure(one) for world, one in traces.items()} for part, measure in measures.items()}
    for i, coordinate in enumerate(COORDINATES):
        for part, values in found.items():
            if part != BALANCE or coordinate != "theta":
                numbers = {world: None if value is None else float(value[i]) for world, value in values.items()}
                yield {"part": part, **condition.row(), "coordinate": coordinate, **numbers,
                       "hand": float(ideal.hand_force[-1, i])}  # fmt: skip


def _forces_hold(row: Row) -> bool | None:
    """Return whether IAPB has a higher peak than PB, balances the hand, or has the force closest to ideal."""
    if row["part"] == BALANCE:
        return None if row["IAPB"] is None else bool(abs(row["IAPB"] + row["hand"]) <= BALANCED)
    if max(row[world] for world in WORLDS) < NOTHING:
        return None
    return bool(row["IAPB"] > row["PB"] if row["part"] == LARGE else row["IAPB"] < min(row["PB"], row["CBuc"]))


def _forces_say(table: Table) -> str:
    texts = []
    for coordinate, unit in (("x", "N"), ("y", "N"), ("theta", "N m")):
        rows = table.where(part=LARGE, coordinate=coordinate)
        texts.append(f"{coordinate} {max(rows.column('IAPB')):.3g} {unit} (PB {max(rows.column('PB')):.3g})")
    rms = ", ".join(f"{sum(found)} of {len(found)} in {name}" for name in COORDINATES
                    for found in [table.where(part=CLOSEST_RMS, coordinate=name).decided])
    return (
        f"Largest forces with IAPB: {', '.join(texts)}. The distance of two forces is the mean of |F − F_ideal|. "
        f"Beyond the paper: if the distance is the RMS of F − F_ideal, IAPB is closest in {rms}. An impulse p acts as "
        "the force p/Δt over one step. If it comes one step later than in the ideal world, two steps enter the RMS "
        "with p/Δt, and their weight grows as the step gets shorter."
    )


C11 = peg_claim(
    "C11", "Forces are large on new contact, only balance the hand while in contact, and are closest to ideal.",
    place="Section VI, Fig. 8",
    quantity="Peak force of the device's actuators; their mean force after settling; mean of |F − F_ideal| over the "
    "steps. Beyond the paper: the RMS of F − F_ideal, which grows without limit as the step Δt shrinks.",
    tolerance="Peak: larger than PB's. Mean force: within 0.05 N of the hand force; 0.05 N is the damper's force at "
    "the largest speed that counts as settled. Distance: the smallest. A trial cannot tell if all are below 1e-9.",
    row=_forces, holds=_forces_hold, says=_forces_say, parts=("part", "coordinate"), axes=("tilt", "clearance", "part"),
    roles={CLOSEST_RMS: BEYOND},
)  # fmt: skip


# C12: renderings on a device with force limits

MOST, LEAST = "saturating loses most", "spreading loses least"


def _lost(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield per coordinate the distances of three renderings from the device without limits."""
    full = trace(study, condition, "IAPB")
    traces = {rendering: trace(study, condition, "IAPB", rendering) for rendering in RENDERINGS}
    window = comparison_window([full, *traces.values()])
    lost = {rendering: root_mean_square(one, full, window) for rendering, one in traces.items()}
    for i, coordinate in enumerate(COORDINATES):
        numbers = {rendering: float(distance[i]) for rendering, distance in lost.items()}
        for claimed in (MOST, LEAST):
            yield {"coordinate": coordinate, "part": claimed, **condition.row(*LIMITED), **numbers,
                   "impacts limited": share_limited(traces["scale"])}  # fmt: skip


def _most_or_least(row: Row) -> bool | None:
    """Return whether saturating is strictly worst, or spreading strictly best; None if no impulse reaches the limit."""
    saturate, scale, spread = (row[rendering] for rendering in RENDERINGS)
    if row["impacts limited"] == 0.0 or max(saturate, scale, spread) < INDISTINGUISHABLE:
        return None
    return bool(saturate > max(scale, spread) if row["part"] == MOST else spread < min(saturate, scale))


def _lost_says(table: Table) -> str:
    texts = []
    for coordinate, unit, factor in (("x", "µm", 1e6), ("y", "µm", 1e6), ("theta", "mrad", 1e3)):
        rows = table.where(part=MOST, coordinate=coordinate)
        medians = " / ".join(f"{factor * float(np.median(rows.column(name))):.3g}" for name in RENDERINGS)
        texts.append(f"{coordinate}: {medians} {unit}")
    return f"Median distance to the unlimited device (saturated / scaled / spread): {'; '.join(texts)}."


C12 = peg_claim(
    "C12", "Saturating the impulses at the device loses most performance, spreading them over steps loses least.",
    limited=True, place="Section VI, Fig. 9",
    quantity="RMS distance of the device trajectory from that of a device without limits, per coordinate.",
    tolerance="Saturating: strictly the largest distance of the three. Spreading: strictly the smallest. A trial "
    "cannot tell if no impulse reaches the limit, or if all three distances are below 1e-7 m or rad.",
    row=_lost, holds=_most_or_least, says=_lost_says, parts=("coordinate", "part"),
    axes=("tilt", "clearance", "coordinate", "part"),
)  # fmt: skip


# C13: the trajectory with force limits

PENETRATION = "penetration"


def _limited_trajectory(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield per coordinate the distances from ideal, then the penetrations; IAPB spreads its impulses over steps."""
    start = condition.row("force_limit", *START)
    yield from (start | row for row in distances(study, condition, "spread"))
    yield start | {"coordinate": PENETRATION,
                   "IAPB": deepest_penetration(trace(study, condition, "IAPB", "spread")),
                   "PB": deepest_penetration(trace(study, condition, "PB"))}  # fmt: skip


def _limited_trajectory_says(table: Table) -> str:
    depths = table.where(coordinate=PENETRATION)
    ours, theirs = (1e3 * float(np.median(depths.column(world))) for world in ("IAPB", "PB"))
    return (
        f"With limits the distance of IAPB to ideal, divided by that of PB, has these medians: {_ratios_to_pb(table)}. "
        f"The median penetration is {ours:.2f} mm with IAPB and {theirs:.2f} mm with PB."
    )


C13 = peg_claim(
    "C13", "With device limits, IAPB stays closest to ideal and penetrates less than PB.",
    limited=True, place="Section VI, Fig. 10",
    quantity="The distances of C10, with each impulse spread over several steps. The device's force limits are 1 or "
    "0.3 times the paper's. Also the deepest overlap of tool and walls.",
    tolerance=f"IAPB's value is the smallest. {CANNOT_TELL}",
    row=_limited_trajectory, says=_limited_trajectory_says,
    holds=lambda row: bool(row["IAPB"] < row["PB"]) if row["coordinate"] == PENETRATION else closest(row),
    parts=("coordinate",), axes=("tilt", "clearance", "coordinate"),
)  # fmt: skip


# C14: the forces with force limits

# A hundredth of the smallest force that a fingertip feels (0.05 N); for theta, that force at the peg's half length.
NOT_FELT = {"x": 5e-4, "y": 5e-4, "theta": 5e-6}


def _limited_forces(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield the peak forces per coordinate; IAPB spreads its impulses over steps."""
    limited = peak_force(trace(study, condition, "IAPB", "spread"))
    penalty = peak_force(trace(study, condition, "PB"))
    for i, coordinate in enumerate(COORDINATES):
        yield {**condition.row(*LIMITED), "coordinate": coordinate, "IAPB": float(limited[i]), "PB": float(penalty[i])}


def _limited_forces_hold(row: Row) -> bool | None:
    """Return whether the peak of IAPB is above that of PB; None if neither peak can be felt."""
    if max(row["IAPB"], row["PB"]) < NOT_FELT[row["coordinate"]]:
        return None
    return bool(row["IAPB"] > row["PB"])


def _limited_forces_say(table: Table) -> str:
    texts = []
    for coordinate in COORDINATES:
        rows = table.where(coordinate=coordinate)
        ratios = [row["IAPB"] / row["PB"] for row, held in zip(rows.records(), rows.holds, strict=True)
                  if held is not None and row["PB"] > 0.0]  # fmt: skip
        texts.append(f"{coordinate} median {np.median(ratios):.2g}, least {min(ratios):.2g}")
    return f"Peak force of IAPB with device limits, divided by PB's peak force: {'; '.join(texts)}."


C14 = peg_claim(
    "C14", "Impulses kept within the device's limits still exceed the penalty forces felt on contact.",
    limited=True, place="Section VI, Fig. 11",
    quantity="Peak force of the device's actuators in the run, per coordinate: IAPB with spread impulses, and PB.",
    tolerance="IAPB's peak is strictly larger. A trial cannot tell if neither peak reaches a hundredth of the least "
    "force that can be felt.",
    row=_limited_forces, holds=_limited_forces_hold, says=_limited_forces_say, parts=("coordinate",),
    axes=("tilt", "force_limit", "coordinate"),
)  # fmt: skip


# C15: bounces and settling

FEWER, NO_MORE, SETTLES = "bounces strictly less", "bounces no more", "settles strictly sooner"


def _settling(study: Study, condition: Condition) -> Iterator[Row]:
    """Yield the rows of one start: without device limits, and with limits and spread impulses."""
    penalty = trace(study, condition, "PB")
    for rendering in ("full", "spread"):
        ours = trace(study, condition, "IAPB", rendering)
        for part, measure in ((FEWER, bounces), (NO_MORE, bounces), (SETTLES, _settled)):
            yield {"part": part, **condition.row(), "rendering": rendering, "IAPB": measure(ours),
                   "PB": measure(penalty)}  # fmt: skip


def _settled(trace: Trace) -> float:
    """Settling time [s]; infinite if the peg still moves at the end."""
    time = settling_time(trace)
    return np.inf if time is None else time


def _settling_holds(row: Row) -> bool | None:
    """Return whether IAPB has less than PB (`NO_MORE`: at most as much); None if both never bounce, or never settle."""
    ours, theirs = row["IAPB"], row["PB"]
    if ours == theirs == (np.inf if row["part"] == SETTLES else 0):
        return None
    return bool(ours <= theirs) if row["part"] == NO_MORE else bool(ours < theirs)


def _settling_says(table: Table) -> str:
    texts = []
    for rendering in ("full", "spread"):
        hops, settling = (table.where(part=part, rendering=rendering) for part in (FEWER, SETTLES))
        times = " s, with PB ".join(f"{np.median(settling.column(world)):.2f}" for world in ("IAPB", "PB"))
        pairs = list(zip(hops.column("IAPB"), hops.column("PB"), strict=True))
        fewer, same = sum(a < b for a, b in pairs), sum(a == b for a, b in pairs)
        texts.append(
            f"With {rendering} impulses the peg bounces {sum(a for a, _ in pairs)} times in {len(pairs)} runs, with PB "
            f"{sum(b for _, b in pairs)} times. It bounces less often than with PB in {fewer} runs, as often in {same} "
            f"(never in either world in {pairs.count((0, 0))} of these), and more often in "
            f"{len(pairs) - fewer - same}. The median settling time is {times} s."
        )
    return " ".join(texts)


C15 = peg_claim(
    "C15", "At 512 Hz the peg bounces less and settles sooner than with PB, with or without device limits.",
    place="Section VII, Fig. 12 and 13 (an experiment there; an emulated device here)",
    quantity="How often a corner of the device's peg leaves a wall by more than 10 µm after touching it; time from "
    "the first contact until the device stays below 1 mm/s and 0.01 rad/s.",
    tolerance="Strictly fewer bounces, and strictly sooner: a tie fails. A separate part tests whether IAPB bounces at "
    "most as often. A trial cannot tell if the peg bounces (or settles) in neither world.",
    row=_settling, holds=_settling_holds, says=_settling_says, parts=("part",), conditions=(*START, "rendering"),
    named={FEWER: "bounces", NO_MORE: "bounces", SETTLES: "settling time"},
    axes=("tilt", "clearance", "part"),
)  # fmt: skip


# C16: tool and device together

# Tool and device start alike and get the same forces, so they differ only by rounding over 1536 steps. A micrometre (or
# microradian) is a thousand times larger than this, and a hundredth of the separation by saturation.
TOGETHER, APART = 1e-9, 1e-6


def _separation(study: Study, condition: Condition) -> Iterator[Row]:
    limited = share_limited(trace(study, condition, "IAPB", "scale"))
    for rendering in RENDERINGS:
        x, y, theta = map(float, largest_separation(trace(study, condition, "IAPB", rendering)))
        yield {"rendering": rendering, **condition.row(*LIMITED), "distance [m]": max(x, y), "angle [rad]": theta,
               "impacts limited": limited}  # fmt: skip


def _separation_holds(row: Row) -> bool | None:
    """Return whether tool and device stay together, or separate if saturated; None if no impulse reached the limit."""
    if row["impacts limited"] == 0.0:
        return None
    apart = max(row["distance"], row["angle"])
    return bool(apart > APART if row["rendering"] == "saturate" else apart <= TOGETHER)


def _separation_says(table: Table) -> str:
    rows = {rendering: table.where(rendering=rendering) for rendering in RENDERINGS}
    texts = (f"{rendering} up to {max(found.column('distance')):.1e} m and {max(found.column('angle')):.1e} rad"
             for rendering, found in rows.items())  # fmt: skip
    return f"Largest separation of tool and device: {'; '.join(texts)}."


C16 = peg_claim(
    "C16", "Scaling and spreading keep tool and device together on impact; saturating does not.",
    limited=True, place="Section VI",
    quantity="Largest difference of tool and device over the run, in position and angle.",
    tolerance="Together: at most 1e-9 m and rad, the rounding over 1536 steps. Apart: more than 1e-6 m or rad.",
    row=_separation, holds=_separation_holds, says=_separation_says, parts=("rendering",),
    axes=("tilt", "force_limit", "rendering"),
)  # fmt: skip
