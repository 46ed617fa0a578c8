"""Study "haptic-rate": times of steps and impacts compared with other engines and solvers, and their growth with size.

One run times everything that `iapb bench` measures except the impact methods, one question after another. A report
takes two of these tables from other findings, so that nothing is measured twice (`quoting`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from iapb.errors import MissingDependencyError
from verification.cost.against_mujoco import (
    PART_COLUMNS,
    RACE_COLUMNS,
    WHOLE,
    fastest_of_theirs,
    profile_step,
    race_mujoco,
)
from verification.cost.calls import PRINTED
from verification.cost.growth import (
    FACTORED,
    TITLES,
    exponent,
    fitted,
    haptic_rate,
    most_contacts,
    power_law,
    scaling,
    steepest,
)
from verification.cost.impacts import anytime, order_bias
from verification.cost.many_bodies import LEAST_BODIES, study_many_bodies
from verification.cost.resting_scenes import resting_scenes
from verification.cost.start_up import start_up
from verification.cost.step_cost import IAPB, KERNEL, Rivals, impact_cost, rivals
from verification.cost.trajectories import (
    BELOW,
    FIT_FALL,
    FIT_RUNS,
    USEFUL,
    WORLDS,
    times,
    trajectory_precision,
    worth,
)
from verification.finding import (
    FAILED_CASES,
    MIXED,
    NOT_COMPUTED,
    REPRODUCED,
    Column,
    Failure,
    Finding,
    Part,
    Quantities,
    Row,
    Table,
    attempt,
    finding_of,
    of_each,
    table_of,
)
from verification.mechanics.against_pinocchio import SHIPPED, robot_files
from verification.mechanics.robot_timing import LARGEST_RATIO, MANY, ONE, time_robots

KEY, TITLE = "haptic-rate", "The haptic rate"
QUESTION = (
    "A haptic loop must finish each step within a millisecond. This page compares the engine's times with those of "
    "MuJoCo, Pinocchio, the printed formula and complementarity solvers. The programs are timed in turns within one "
    "run, because ratios depend less on the machine than seconds. Where the engine misses a target, the parts of its "
    "step show where the time is spent."
)
FACTORS = {60: 10.0, 300: 100.0}  # contacts at 12 coordinates -> target factor by which the printed formula is slower
LARGEST_EXPONENT = {"contacts": 1.1, "bodies": 1.2}
# tables that a report quotes from other findings
RATE, SOLVERS, KERNELS = "contacts at 1 kHz", "solvers", "compiled, IAPB and Lemke"
SOLVER_CONTACTS = {"quick": (1, 4, 16, 64), "full": (1, 4, 16, 64, 128, 300)}

Progress = Callable[[str, int, int], None]
Tables = Mapping[str, Table]


def compute(runner: Any, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Measure and return the finding of this topic of the report; no run is stored.

    Quantities that other findings of a report measure are not measured here: see `quoting`.
    """
    failures: list[Failure] = []
    return finding(dict(measured(depth, lambda stage, done, total: progress(done, total), failures)), failures)


def haptic_study(depth: str = "quick", progress: Progress | None = None) -> Finding:
    """Measure everything one after another, without any other computation of ours at the same time."""
    failures: list[Failure] = []
    say = progress or (lambda stage, done, total: None)
    found = dict(measured(depth, say, failures))
    rate = haptic_rate(progress=lambda done, total: say("contacts at 1 kHz", done, total), failures=failures)
    costs = impact_cost(SOLVER_CONTACTS[depth], repeats=5 if depth == "full" else 3, progress=say, failures=failures)
    return finding(found | {RATE: _rate(rate), SOLVERS: costs}, failures)


def quoting(found: Finding, others: Iterable[Finding]) -> Finding:
    """Return the finding of `compute` with tables of others: contacts at 1 kHz (C19), and times of solvers (C22).

    A report measures each of these once. If the other finding is absent, the sentence says that it is missing.
    """
    if not found.tables:
        return found
    tables = {name: table for name, table in found.tables.items() if name != FAILED_CASES}
    for other in others:
        if other.key == "C19" and "C19" in other.tables:
            tables[RATE] = _rate(other.tables["C19"])
        elif other.key == "C22" and "C22" in other.tables:
            tables[KERNELS] = other.tables["C22"]
        elif other.key == "complementarity" and "time per impact" in other.tables:
            tables[SOLVERS] = other.tables["time per impact"]
    return finding(tables, list(found.failures))


def measured(depth: str, say: Progress, failures: list[Failure]) -> Iterator[tuple[str, Table]]:
    """Yield the tables by name; a case that raises an exception has no row."""
    full = depth == "full"

    def within(stage: str) -> Callable[[int, int], None]:
        return lambda done, total: say(stage, done, total)

    yield "steps against MuJoCo", _races(20 if full else 9, within("a step against MuJoCo"), failures)
    scenes = of_each(resting_scenes(), partial(profile_step, rounds=15 if full else 7), failures,
                     lambda scene: f"parts of a step, {scene.name}")  # fmt: skip
    yield "parts of a step", table_of(PART_COLUMNS, scenes, digits=3, note="Each part repeated by itself in compiled "
                                                                           "code.")  # fmt: skip
    times = scaling(15 if full else 7, within("scaling laws"), failures)
    yield "scaling", times
    yield "fitted", fitted(times)
    yield "bodies", study_many_bodies(failures=failures)
    if (robots := attempt("robots", partial(_robots, depth), failures)) is not None:
        yield "robots", robots
    yield "start", start_up(depth, failures)
    yield "budgets", anytime(40 if full else 15, within("budgets"), failures)
    motions = trajectory_precision(depth=depth, progress=within("whole motions"), failures=failures)
    yield "motions", motions
    yield "worth", worth(motions, WORLDS)
    yield "order bias", order_bias()


def _races(rounds: int, progress: Callable[[int, int], None], failures: list[Failure]) -> Table:
    """Return the table of steps against MuJoCo; without MuJoCo the table is empty, and its note says why."""
    try:
        return race_mujoco(rounds=rounds, progress=progress, failures=failures)
    except MissingDependencyError as error:
        return Table(RACE_COLUMNS, note=str(error))


def _rate(trials: Table) -> Table:
    """Return the largest number of contacts at 1 kHz (claim C19), one row per number of coordinates."""
    most = most_contacts(trials)
    found = {f"most contacts, {title.removeprefix('the ')}": most.get(title, {}) for title in TITLES.values()}
    sizes = dict.fromkeys(trials.column("coordinates"))
    return Table(
        (Column("coordinates", condition=True), *(Column(name, timed=True) for name in found)),
        tuple((d, *(best.get(d, 0) for best in found.values())) for d in sizes), digits=6,
        note="Largest size tried of which 999 of 1000 impacts end within 1 ms, on this machine.",
    )  # fmt: skip


def _robots(depth: str) -> Table:
    """Return the times of the mechanics on robots of others if their files exist, else on the project's own robots."""
    files, _ = robot_files()
    found = time_robots(None if files else SHIPPED / "robots", depth)
    keys = ("robot", "velocities", "quantity", "form", "time", "Pinocchio", "ratio", "lower quartile", "upper quartile")
    columns = tuple(Column({"time": "ours"}.get(key, key), "µs" if key in ("time", "Pinocchio") else "",
                           condition=k < 4, timed=k >= 4) for k, key in enumerate(keys))  # fmt: skip
    return Table(columns, found.select(keys).rows, digits=3,
                 note="robots of other projects" if files else "the project's own robots")  # fmt: skip


def finding(tables: Tables, failures: list[Failure]) -> Finding:
    """Return the finding of the tables, one or more parts per question."""
    failures, parts = list(failures), list[Part]()
    for say in (_say_races, _say_printed, _say_solvers, _say_growth, _say_rate, _say_bodies, _say_robots, _say_start,
                _say_motions, _say_worth, _say_budgets, _say_order):  # fmt: skip
        subject = say.__name__.removeprefix("_say_")
        parts += attempt(f"sentences on {subject}", lambda say=say: list(say(tables)), failures) or []  # type: ignore[misc]
    met = sum(part.verdict == REPRODUCED for part in parts)
    targets = ("speed targets", f"{met} of {len(parts)}")
    answer = f"{targets[1]} speed targets met"
    for contacts, _, _, ratio in list(_printed_over_factored(tables))[-1:]:
        answer += f"; with {contacts} contacts the engine's impact is {ratio:.0f} times as fast as the printed formula"
    return finding_of(KEY, TITLE, QUESTION, f"{answer}.", parts, tables, failures, (targets,))


def _part(sentence: str, met: bool, timed: bool = True, miss: str = "", quantities: Quantities = ()) -> Part:
    """Return a part with its verdict; `miss` is the text for the first page if the target is missed."""
    return Part(sentence, REPRODUCED if met else MIXED, timed=timed, miss="" if met else miss, quantities=quantities)


def _missing(sentence: str) -> Part:
    return Part(sentence, NOT_COMPUTED, timed=True)


def _say_races(tables: Tables) -> Iterator[Part]:
    races = tables["steps against MuJoCo"]
    if not races.rows:
        yield _missing(f"Time of a step compared with MuJoCo: {races.note}")
        return
    chosen = fastest_of_theirs(races)
    for scene in dict.fromkeys(races.column("scene")):
        forms = [race for race in chosen if race["scene"] == scene]
        texts = [
            "{ratio:.2g} times MuJoCo's time with {MuJoCo's form} ({MuJoCo's contacts:.0f} contacts, solver "
            "{MuJoCo's solver}, quartiles {quartiles})".format_map(race) for race in forms
        ]  # fmt: skip
        met = all(race["ratio"] <= race["target"] for race in forms)
        missed = "" if met else f" Largest parts of the step: {_largest_parts(tables['parts of a step'], scene)}."
        ours, target = (forms[0][key] for key in ("iapb's contacts", "target"))
        yield _part(
            f"{scene.capitalize()}, at rest: a recorded step of the engine, with {ours:.0f} contacts, takes "
            f"{'; '.join(texts)}. Target: at most {target:g}.{missed}", met,
            miss=f"a step of the {scene} takes {max(race['ratio'] for race in forms):.2g} of MuJoCo's time (target "
                 f"{target:g})")  # fmt: skip


def _largest_parts(parts: Table, scene: str) -> str:
    """Return in words the largest parts of a step's time, and the step's time without the largest part."""
    here = parts.where(scene=scene)
    times = dict(zip(here.column("part"), here.column("time"), strict=True))
    whole = times.pop(WHOLE)
    largest = sorted(times.items(), key=lambda item: -item[1])[:3]
    return (f"{', '.join(f'{name} {100 * t / whole:.0f} %' for name, t in largest)}; without the first of these the "
            f"step would take {100 * (1 - largest[0][1] / whole):.0f} % of its time")  # fmt: skip


def _printed_over_factored(tables: Tables) -> Iterator[tuple[int, float, float, float]]:
    """Yield (contacts, factored time [µs], printed time [µs], ratio) at d = 12, for the contacts of FACTORS."""
    for contacts in FACTORS:
        here = tables["scaling"].where(coordinates=12, contacts=contacts)
        times = dict(zip(here.column("method"), here.column("time"), strict=True))
        if {FACTORED, PRINTED} <= set(times):
            yield contacts, times[FACTORED], times[PRINTED], times[PRINTED] / times[FACTORED]


def _say_printed(tables: Tables) -> Iterator[Part]:
    for contacts, ours, printed, ratio in _printed_over_factored(tables):
        wanted = FACTORS[contacts]
        yield _part(
            f"With 12 coordinates and {contacts} contacts the engine's (factored) impact takes {ours:.3g} µs, the "
            f"printed formula {printed:.3g} µs: {ratio:.0f} times as long. Target: at least {wanted:g}.",
            ratio >= wanted,
            miss=f"the factored impact of {contacts} contacts is {ratio:.0f} times as fast as the printed formula "
                 f"(target {wanted:g})")  # fmt: skip


def _say_solvers(tables: Tables) -> Iterator[Part]:
    """Yield one part per way of calling; it says where IAPB is faster than the solvers, and where it is slower."""
    if SOLVERS not in tables:
        yield _missing("Times of complementarity solvers: the page Against complementarity was not computed.")
        return
    found = rivals(tables[SOLVERS])
    if KERNELS in tables:
        yield _say_kernels(tables[KERNELS])
    for called in ("from Python",) if KERNELS in tables else ("compiled", "from Python"):
        pairs = [pair for pair in found if pair.called == called and pair.solver["outcome"] == "solved"]
        slower = [pair for pair in pairs if pair.costs_more is False]
        decided = [pair for pair in pairs if pair.costs_more is not None]
        if not decided:
            yield _missing(f"The times of no complementarity solver {called} differ clearly from IAPB's.")
            continue
        checks = _checks(tables[SOLVERS]) if called == "from Python" else ""
        yield _part(
            f"One impact, from M, J and v to v⁺ at the same accuracy, {called} on both sides: IAPB is faster in "
            f"{len(decided) - len(slower)} of the {len(decided)} pairs of solver and size whose times differ clearly "
            f"({len(pairs) - len(decided)} do not){_slower(slower)}.{checks}", not slower,
            miss=f"{called}, IAPB is slower than a solver in {len(slower)} of {len(decided)} pairs of solver and size"
        )  # fmt: skip


def _say_kernels(table: Table) -> Part:
    """Say where Lemke's method is faster than IAPB by the times of claim C22, which the figure of them shows."""
    decided = [(row, held) for row, held in zip(table.records(), table.holds, strict=True) if held is not None]
    slower = [row for row, held in decided if not held]
    sizes = {name: [row["contacts"] for row in slower if row["problem"] == name]
             for name in dict.fromkeys(row["problem"] for row in slower)}  # fmt: skip
    where = " and ".join(f"with {min(found)} to {max(found)} {name}" for name, found in sizes.items())
    return _part(
        f"One impact, from M, J and v to v⁺ at the same accuracy, compiled on both sides (claim C22): IAPB is faster "
        f"than Lemke's method in {len(decided) - len(slower)} of the {len(decided)} impacts whose times differ clearly "
        f"({len(table.rows) - len(decided)} do not){f'; slower {where}' if where else ''}.", not slower,
        miss=f"compiled, IAPB is slower than Lemke's method in {len(slower)} of {len(decided)} impacts")  # fmt: skip


def _slower(pairs: list[Rivals]) -> str:
    """Return in words the solvers and sizes at which IAPB is slower."""
    at: dict[tuple[str, str], list[int]] = {}
    for pair in pairs:
        at.setdefault((pair.solver["solver"], pair.solver["impacts"]), []).append(pair.solver["contacts"])
    texts = [f"{solver} on the {family} at {', '.join(map(str, sorted(contacts)))} contacts"
             for (solver, family), contacts in at.items()]  # fmt: skip
    return f"; slower than {', '.join(texts)}" if texts else ""


def _checks(solvers: Table) -> str:
    """Return a sentence on the share of the impact itself in the time of a call from Python."""
    kernel, whole = (
        {(row["impacts"], row["contacts"]): row["median"] for row in solvers.where(solver=name).records()}
        for name in (KERNEL, IAPB)
    )  # fmt: skip
    shares = [100 * kernel[key] / whole[key] for key in kernel if key in whole]
    return (f" The impact itself takes {min(shares):.0f} to {max(shares):.0f} % of a call of IAPB from Python; checks "
            "of the input and conversion of the result take the rest. The solvers' times include our adapter, which "
            "checks the input and forms W. Without it DAQP is several times as fast.")  # fmt: skip


def _say_growth(tables: Tables) -> Iterator[Part]:
    times = tables["scaling"]
    power, printed = (exponent(times, method, "contacts") for method in (FACTORED, PRINTED))
    wide = exponent(times, FACTORED, "coordinates")
    ends = [" (steepest from {:g} to {:g}: {:.2f})".format(*row) for row in tables["fitted"].where(method=FACTORED)
            .select(("steepest from", "to", "there")).rows]  # fmt: skip
    sizes = times.where(method=FACTORED, coordinates=12).column("contacts")
    yield _part(
        f"The time of the factored impact grows as the number of contacts to the power {power:.2f} from {min(sizes)} "
        f"to {max(sizes)} contacts{ends[0]}, that of the printed formula to the power {printed:.2f}. With the number "
        f"of coordinates it grows to the power {wide:.2f}{ends[1]}. Target: at most {LARGEST_EXPONENT['contacts']:g} "
        "for contacts.",
        power <= LARGEST_EXPONENT["contacts"],
        miss=f"the impact's time grows as contacts to the power {power:.2f} (target {LARGEST_EXPONENT['contacts']:g})"
    )  # fmt: skip


def _say_rate(tables: Tables) -> Iterator[Part]:
    if RATE not in tables:
        yield _missing("Number of contacts within a millisecond: claim C19 was not computed.")
        return
    texts = [f"{ours} at d = {d} ({printed} by the printed formula)" for d, ours, printed in tables[RATE].rows]
    yield _part(f"Largest number of contacts at which 99.9 % of the impacts take less than a millisecond (claim C19): "
                f"{', '.join(texts)}.", True)


def _say_bodies(tables: Tables) -> Iterator[Part]:
    rows = [row for row in tables["bodies"].records() if row["bodies"] >= LEAST_BODIES]
    power, last = power_law([row["bodies"] for row in rows], [row["step"] for row in rows]), rows[-1]
    yield _part(
        f"A step of {last['bodies']} free bodies takes {last['step']:.3g} µs. From {LEAST_BODIES} bodies on the time "
        f"grows as their number to the power {power:.2f}, fitted over all sizes{_steepest(rows)}. "
        f"Target: at most {LARGEST_EXPONENT['bodies']:g}.", power <= LARGEST_EXPONENT["bodies"],
        miss=f"the time of a step grows as the number of bodies to the power {power:.2f} (target "
             f"{LARGEST_EXPONENT['bodies']:g})",
        quantities=(("exponent of bodies", f"{power:.2f}"),))  # fmt: skip
    tested = power_law([row["bodies"] for row in rows], [row["pairs tested"] for row in rows])
    yield _part(
        f"With the broad phase the number of tested pairs of shapes grows as the number of bodies to the power "
        f"{tested:.2f}: {last['pairs tested']:.0f} of {last['pairs of shapes']:,} pairs for {last['bodies']} free "
        f"bodies. Target: at most {LARGEST_EXPONENT['bodies']:g}.", tested <= LARGEST_EXPONENT["bodies"], timed=False,
        miss=f"the pairs tested grow as the number of bodies to the power {tested:.2f}")  # fmt: skip


def _steepest(rows: Sequence[Row]) -> str:
    """Return in words where the time grows fastest with the number of bodies, and the number of contacts there."""
    if len(rows) < 3:
        return ""
    low, high, slope = steepest([row["bodies"] for row in rows], [row["step"] for row in rows])
    touching = {row["bodies"]: row["contacts"] for row in rows}
    return (f"; it grows fastest from {low:g} to {high:g} bodies, with the power {slope:.2f}, where the contacts in a "
            f"step increase from {touching[low]:.2g} to {touching[high]:.2g}")  # fmt: skip


def _say_robots(tables: Tables) -> Iterator[Part]:
    robots = tables.get("robots")
    for form, limit in ((ONE, LARGEST_RATIO), (MANY, 1.0)):
        rows = robots.where(form=form).records() if robots else []
        if robots is None or not rows:
            yield _missing(f"Mass matrix and bias compared with Pinocchio, {form}: not timed.")
            continue
        worst, best = (choose(rows, key=lambda row: float(row["ratio"])) for choose in (max, min))
        yield _part(
            f"Mass matrix and bias of {len({row['robot'] for row in rows})} robots ({robots.note}), {form}: "
            f"{best['ratio']:.2g} to {worst['ratio']:.2g} times Pinocchio's time, called from Python (largest for the "
            f"{worst['quantity']} of {worst['robot']}). Target: {'below' if form == MANY else 'at most'} {limit:g}.",
            worst["ratio"] <= limit, miss=f"the {worst['quantity']} of {worst['robot']}, {form}, takes "
                                          f"{worst['ratio']:.2g} "
                                          f"times Pinocchio's time (target {limit:g})")  # fmt: skip


def _say_start(tables: Tables) -> Iterator[Part]:
    for row in tables["start"].records():
        yield _part(
            f"{row['what']} takes {row['on the wall']:.2f} s of wall time and {row['computing']:.2f} s of CPU time. "
            f"Target: less than {row['target']:g} s of CPU time.", row["computing"] < row["target"],
            miss=f"{row['what']} takes {row['computing']:.2f} s of CPU time (target {row['target']:g} s)",
        )  # fmt: skip


def _say_budgets(tables: Tables) -> Iterator[Part]:
    rows = tables["budgets"].records()
    gains = sum(row["largest relative gain"] > 0.0 for row in rows)
    half = [100 * row["share of the loss"] for row in rows if row["budget"] == row["rank"] // 2]
    yield _part(
        f"An impact that stops early, after a budget of rows, gains energy in {gains} of {len(rows)} combinations of "
        f"size and budget (computed exactly). Half of the rows already take {min(half):.0f} to {max(half):.0f} % of "
        "the energy that all rows take.", gains == 0, timed=False)  # fmt: skip


def _say_motions(tables: Tables) -> Iterator[Part]:
    """Yield one part per scene with the best errors, and our fastest time at MuJoCo's best accuracy."""
    motions = tables["motions"]
    for scene in dict.fromkeys(motions.where(outcome="ok").column("scene")):
        here = motions.where(scene=scene, outcome="ok").records()
        lost = len(motions.where(scene=scene).rows) - len(here)
        best = {name: min(chosen, key=lambda run: (run["position"], run["time"]))
                for name in ("IAPB", "PB", "ideal", "MuJoCo")
                if (chosen := [run for run in here if run["method"].startswith(name)])}  # fmt: skip
        text = ", ".join(f"{name} {_error(run)} in {run['time']:.3g} ms per simulated second"
                         for name, run in best.items())
        sentence = f"Whole motion, {scene}: smallest position error, in lengths of the body: {text}"
        most = min(best, key=lambda name: float(best[name]["position"]))
        met = best["IAPB"]["position"] <= best[most]["position"]
        miss = f"on the whole motion of {scene} another method is as exact in less time"
        if not met:
            miss = (f"on the whole motion of {scene} no step of IAPB is as exact as {most} "
                    f"({_error(best['IAPB'])} against {_error(best[most])})")  # fmt: skip
        if "MuJoCo" in best:
            ours = [run for run in here if run["method"].startswith("IAPB")]
            as_good = [run["time"] for run in ours if run["position"] <= best["MuJoCo"]["position"]]
            met = met and bool(as_good) and min(as_good) <= best["MuJoCo"]["time"]
            if as_good:
                sentence += f"; IAPB reaches MuJoCo's smallest error in {min(as_good):.3g} ms per simulated second"
        yield _part(sentence + (f". {lost} of the runs of all methods failed or took too long." if lost else "."), met,
                    miss=miss)


def _say_worth(tables: Tables) -> Iterator[Part]:
    rows = tables["worth"].records()
    names = {row["method"]: row["method"].split(",")[0].removesuffix(" (QP per step)") for row in rows}
    costs = [f"{names[row['method']]} {times(row['tenfold accuracy costs'])} ({row['scenes fitted']} of "
             f"{row['scenes']} scenes)" for row in rows if row["scenes fitted"]]  # fmt: skip
    stays = [names[row["method"]] for row in rows if row["error stays"] == row["scenes"]]
    never = [names[row["method"]] for row in rows if not row["best for its time"] and not row["cut short"]]
    cut = [f"{names[row['method']]} on {row['cut short']} of {row['scenes']} scenes" for row in rows
           if not row["best for its time"] and row["cut short"]]  # fmt: skip
    unknown = f"; not decided, because finer steps would take too long: {', '.join(cut)}" if cut else ""
    level = f"; with {', '.join(stays)} no shorter step reduces the error" if stays else ""
    yield _part("Ten times the accuracy of a whole motion multiplies the computing time by (median over the scenes "
                f"where at least {FIT_RUNS} runs span a {FIT_FALL:g}-fold fall of the error): "
                f"{', '.join(costs)}{level}. Methods that on every scene are slower and less exact than another, or "
                f"miss an error of {USEFUL:g} lengths: {', '.join(never) or 'none'}{unknown}.", True)


def _say_order(tables: Tables) -> Iterator[Part]:
    rows = tables["order bias"].records()
    worst = max(rows, key=lambda row: float(row["spread"]))
    yield _part("Bias by the order of timing: if a method is timed right after each of the others, its medians differ "
                "by at most "
                f"{worst['spread']:.2g} % ({worst['method']}). Target: at most 10 %.", worst["spread"] <= 10.0,
                miss=f"the order of timing biases {worst['method']} by {worst['spread']:.2g} % (target 10 %)")


def _error(run: Row) -> str:
    below = "position" in run["note"] and run["note"].endswith(BELOW)
    return f"{BELOW} of {run['position']:.1e}" if below else f"{run['position']:.1e}"
