"""Topic: what a step costs beside others' engines and solvers, how that grows, and what one millisecond holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from reports.evidence import haptic_rate_tables as tables
from reports.runner import Runner
from verification.finding import LIMITED, NOT_COMPUTED, REPRODUCED, Finding, Part, attempt, finding_of

LEAD = (
    "A haptic loop has a millisecond. How much of it a step needs is measured here beside MuJoCo, Pinocchio, the "
    "printed formula and complementarity solvers, always in turns within one run: a clock's seconds belong to a "
    "machine, ratios less so. Misses of our own targets are shown with where the time goes."
)
FACTORS = {60: 10.0, 300: 100.0}  # contacts -> how many times slower the printed formula is to be
LARGEST_EXPONENT = {"contacts": 1.1, "bodies": 1.2}


def compute(runner: Runner, depth: str, progress: Callable[[int, int], None]) -> Finding:
    """Measure and say what came out; nothing is simulated for keeping."""
    from verification.cost.study import haptic_study

    return topic_of(haptic_study(depth, lambda stage, done, total: progress(done, total)))


def topic_of(study: Any) -> Finding:
    """Findings and tables of a study."""
    failures, findings = list(study.failures), list[Part]()
    for judge in (_races, _printed, _solvers, _growth, _rate, _bodies, _robots, _start_up, _trajectories, _budgets):
        made = attempt(f"sentences on {judge.__name__.strip('_')}", lambda judge=judge: list(judge(study)),  # type: ignore[misc]
                       failures) or []  # fmt: skip
        findings += [replace(finding, timed=judge is not _budgets) for finding in made]
    met = sum(finding.verdict == REPRODUCED for finding in findings)
    verdict = f"{met} of {len(findings)} questions on speed are answered as asked for"
    for last in study.kernels[-1:]:
        verdict += (f"; with {last.contacts} contacts the factored impact is {last.ratio:.0f} times as fast as the "
                    "printed formula")  # fmt: skip
    made_tables = tables.all_tables(study, failures)
    return finding_of("haptic-rate", "The haptic rate", LEAD, f"{verdict}.", findings, made_tables, failures)


def _outcome(met: bool) -> str:
    return REPRODUCED if met else LIMITED


def _races(study: Any) -> Iterator[Part]:
    from verification.cost.against_mujoco import fastest_of_theirs

    if not study.races:
        yield Part(f"A step against MuJoCo's: {study.without_mujoco}", NOT_COMPUTED)
        return
    chosen = fastest_of_theirs(study.races)
    for scene in dict.fromkeys(race.scene for race in chosen):
        forms = [race for race in chosen if race.scene == scene]
        texts = [
            f"{race.ratio.median:.2g} times MuJoCo's as {race.form} ({race.their_contacts:.0f} contacts, "
            f"{race.solver}, {race.theirs.median * 1e6:.2f} µs; quartiles {race.ratio.lower:.2g} to "
            f"{race.ratio.upper:.2g})" for race in forms
        ]  # fmt: skip
        met = all(race.ratio.median <= race.target for race in forms)
        missed = "" if met else f" Where the time goes: {_largest_parts(study, scene)}."
        yield Part(
            f"{scene.capitalize()}, at rest: a recorded step of ours, with {forms[0].contacts:.0f} contacts, takes "
            f"{forms[0].ours.median * 1e6:.2f} µs, {'; '.join(texts)}. Asked for: at most {forms[0].target:g}.{missed}",
            _outcome(met))  # fmt: skip


def _largest_parts(study: Any, scene: str) -> str:
    """Where a step's time goes, and what the ratio would be without its largest part."""
    parts = {part.part: part.seconds.median for part in study.parts if part.scene == scene}
    whole = parts.pop("whole step")
    largest = sorted(parts.items(), key=lambda item: -item[1])[:3]
    return (f"{', '.join(f'{name} {100 * t / whole:.0f} %' for name, t in largest)} of the step; without the first of "
            f"these it would take {100 * (1 - largest[0][1] / whole):.0f} % of its time")  # fmt: skip


def _printed(study: Any) -> Iterator[Part]:
    for found in study.kernels:
        wanted = FACTORS[found.contacts]
        yield Part(
            f"With {found.coordinates} coordinates and {found.contacts} contacts the factored impact takes "
            f"{found.factored.median * 1e6:.3g} µs, the printed formula {found.printed.median * 1e6:.3g} µs: "
            f"{found.ratio:.0f} times as long. Asked for: at least {wanted:g}.", _outcome(found.ratio >= wanted)
        )  # fmt: skip


def _solvers(study: Any) -> Iterator[Part]:
    """One sentence per way of calling: faster everywhere, or where not."""
    from verification.cost.step_cost import rivals

    for called in ("compiled", "from Python"):
        pairs = [pair for pair in rivals(study.solvers) if pair.called == called and pair.solver.verdict == "solved"]
        slower = [pair for pair in pairs if pair.costs_more is False]
        decided = [pair for pair in pairs if pair.costs_more is not None]
        if not decided:
            yield Part(f"No complementarity solver {called} could be told apart from IAPB.", NOT_COMPUTED)
            continue
        parts = []
        for solver, family in dict.fromkeys((pair.solver.solver, pair.solver.family) for pair in slower):
            at = [pair.solver.contacts for pair in slower if (pair.solver.solver, pair.solver.family) ==
                  (solver, family)]  # fmt: skip
            parts.append(f"{solver} on the {family} at {_listed(at)} contacts")
        unsaid = len(pairs) - len(decided)
        checks = _checks(study.solvers) if called == "from Python" else ""
        yield Part(
            f"From M, J, v to v⁺ to the same accuracy, {called} on both sides: IAPB is faster in "
            f"{len(decided) - len(slower)} of {len(decided)} pairings of solver and size that differ clearly "
            f"({unsaid} do not){'; slower than ' + ', '.join(parts) if parts else ''}.{checks}", _outcome(not slower)
        )  # fmt: skip


def _checks(rows: Any) -> str:
    """What of a call from Python is the impact itself."""
    from verification.cost.step_cost import IAPB, KERNEL

    shares = [kernel.median / whole.median for kernel in rows for whole in rows if
              (kernel.solver, whole.solver) == (KERNEL, IAPB) and (kernel.family, kernel.contacts) ==
              (whole.family, whole.contacts)]  # fmt: skip
    least, most = 100 * min(shares), 100 * max(shares)
    return f" Of a call of ours from Python the impact is {least:.0f} to {most:.0f} %, the rest checks and results."


def _listed(contacts: list[int]) -> str:
    return ", ".join(str(count) for count in sorted(contacts))


def _growth(study: Any) -> Iterator[Part]:
    from verification.cost.scaling import exponent

    power, printed = (exponent(study.scaling, method, "contacts") for method in ("factored", "gram_pinv"))
    wide = exponent(study.scaling, "factored", "coordinates")
    sizes = [timing.contacts for timing in study.scaling if timing.method == "factored" and timing.coordinates == 12]
    yield Part(
        f"The time of the factored impact grows as c to the power {power:.2f} from {min(sizes)} to {max(sizes)} "
        f"contacts, the printed formula's as {printed:.2f}; with coordinates as d to the power {wide:.2f}. Asked for: "
        f"at most {LARGEST_EXPONENT['contacts']:g} in c.", _outcome(power <= LARGEST_EXPONENT["contacts"]))  # fmt: skip


def _rate(study: Any) -> Iterator[Part]:
    from verification.cost.haptic_rate import FACTORED, PRINTED, most_contacts

    sizes = dict.fromkeys(trial.coordinates for trial in study.trials)
    texts = [f"{most_contacts(study.trials, FACTORED, d)} at d = {d} ({most_contacts(study.trials, PRINTED, d)} by "
             "the printed formula)" for d in sizes]  # fmt: skip
    yield Part(f"Most contacts with 99.9 % of the impacts under a millisecond: {', '.join(texts)}.", REPRODUCED)


def _bodies(study: Any) -> Iterator[Part]:
    from verification.cost.many_bodies import growth_exponent

    power, costs = growth_exponent(study.bodies), study.bodies
    yield Part(
        f"A step of {costs[-1].bodies} free bodies takes {costs[-1].seconds * 1e6:.3g} µs; from 20 bodies on its time "
        f"grows as their number to the power {power:.2f}. Asked for: at most {LARGEST_EXPONENT['bodies']:g}.",
        _outcome(power <= LARGEST_EXPONENT["bodies"]))  # fmt: skip


def _robots(study: Any) -> Iterator[Part]:
    from verification.mechanics.robot_timing import LARGEST_RATIO, MANY, ONE

    for form, limit in ((ONE, LARGEST_RATIO), (MANY, 1.0)):
        ratios = {(row["robot"], row["quantity"]): row["ratio"] for row in study.robots if row["form"] == form}
        if not ratios:
            yield Part(f"Mass matrix and bias against Pinocchio, {form}: not timed.", NOT_COMPUTED)
            continue
        (robot, quantity), worst = max(ratios.items(), key=lambda item: item[1])
        yield Part(
            f"Mass matrix and bias of {len({robot for robot, _ in ratios})} robots ({study.robots_of}), {form}: "
            f"{min(ratios.values()):.2g} to {worst:.2g} times Pinocchio's, called from Python (most for the {quantity} "
            f"of {robot}). Asked for: {'below' if form == MANY else 'at most'} {limit:g}.",
            _outcome(worst <= limit))  # fmt: skip


def _start_up(study: Any) -> Iterator[Part]:
    for found in study.start_up:
        yield Part(
            f"{found.what} takes {found.wall:.2f} s on the wall, {found.cpu:.2f} s of it computing. Asked for: under "
            f"{found.limit:g} s of computing.", _outcome(found.cpu < found.limit))  # fmt: skip


def _budgets(study: Any) -> Iterator[Part]:
    rows = study.budgets
    gains = sum(row.most_gain > 0.0 for row in rows)
    half = [row.lost for row in rows if row.budget == row.rank // 2]
    yield Part(
        f"Stopped after any number of rows, the impact gains energy in {gains} of {len(rows)} sizes and budgets "
        f"(exactly computed); half of the rows already take {100 * min(half):.0f} to {100 * max(half):.0f} % of the "
        "energy that all of them take.", _outcome(gains == 0))  # fmt: skip


def _trajectories(study: Any) -> Iterator[Part]:
    """Per scene: at the accuracy that MuJoCo reaches at best, the time of our fastest run that is no worse."""
    runs = [run for run in study.trajectories if run.status == "ok"]
    for scene in dict.fromkeys(run.scene for run in runs):
        here = [run for run in runs if run.scene == scene]
        ours = [run for run in here if run.method.startswith("IAPB")]
        best = {name: min(chosen, key=lambda run: run.position) for name in ("IAPB", "PB", "rigid", "MuJoCo")
                if (chosen := [run for run in here if run.method.startswith(name)])}  # fmt: skip
        text = ", ".join(f"{name} {run.position:.1e} in {run.seconds * 1e3:.3g} ms" for name, run in best.items())
        sentence = f"Whole motion, {scene}: smallest error of position (in lengths) {text}"
        met = best["IAPB"].position <= best["PB"].position
        if "MuJoCo" in best:
            as_good = [run.seconds for run in ours if run.position <= best["MuJoCo"].position]
            met = met and bool(as_good) and min(as_good) <= best["MuJoCo"].seconds
            if as_good:
                sentence += f"; IAPB is as exact as MuJoCo's best after {min(as_good) * 1e3:.3g} ms"
        lost = [run for run in study.trajectories if run.scene == scene and run.status != "ok"]
        sentence += f". {len(lost)} runs failed or timed out." if lost else "."
        yield Part(sentence, _outcome(met))
