"""The parts of the finding: each is a text with numbers and a verdict, computed from the record alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from operator import attrgetter

import numpy as np

from verification.complementarity.agreement import REPRODUCED as CONE_TOLERANCE
from verification.complementarity.agreement import SAME, MapCell
from verification.complementarity.convergence import CASES, WITHOUT_TRUTH
from verification.complementarity.extensions import GAIN
from verification.complementarity.problems import ProblemStudy
from verification.complementarity.study import SCENE_RESTITUTIONS, ComparisonStudy
from verification.cost.calls import PRINTED
from verification.cost.step_cost import (
    COMPILED,
    IAPB,
    KERNEL,
    LEMKE_KERNEL,
    costs_more,
    rivals,
    step_rivals,
)
from verification.finding import (
    MIXED,
    NOT_TESTABLE,
    REFUTED,
    REPRODUCED,
    Failure,
    Part,
    Table,
    attempt,
    verdict_of_trials,
)

C05_TOLERANCE = 1e-12
# M(v⁺−v⁻) lies in range(Jᵀ) up to the rounding of two solves with M; condition numbers reach 1e4 in the families.
MOMENTUM = 1e-9
# Largest difference of engine and references: the rounding of some dozens of products of entries of size one.
SAME_MECHANICS = 1e-12
# Largest difference of two solvers of one law: ten times the residual that `reference.complementarity.laws` accepts.
SAME_LAW = 1e-8


def parts_of(study: ComparisonStudy, failures: list[Failure] | None = None) -> tuple[Part, ...]:
    """Return every part, most important first; parts without any case are left out.

    failures : receives the parts that raise an exception, for example because all their cases failed
    """
    found = [attempt(f"sentence on {name.replace('_', ' ')}", partial(make, study), failures)
             for name, make in PARTS.items()]  # fmt: skip
    for each in study.problems:
        found += attempt(f"sentences on {each.folder}", partial(problems, each), failures) or ()
    return tuple(part for part in found if part is not None)


def single_contact(study: ComparisonStudy) -> Part | None:
    """Claim C05: at a single contact the two laws agree."""
    worst = max(c.distance for c in study.single)
    verdict = "reproduced" if worst <= C05_TOLERANCE else "refuted"
    return Part(
        f"C05 {verdict}: at one contact IAPB and the Newton LCP give the same velocity in all {len(study.single)} "
        f"impacts; the largest difference is {worst:.1e} of |v⁻| in the kinetic metric (tolerance "
        f"{C05_TOLERANCE:.0e}).",
        _all(c.distance <= C05_TOLERANCE for c in study.single), "single contact")  # fmt: skip


def wider_class(study: ComparisonStudy) -> Part | None:
    """The laws agree if and only if some p >= 0 gives IAPB's velocity."""
    cells = study.cells + study.scenes
    cases, against = sum(c.cases for c in cells), sum(c.contradictions for c in cells)
    whole = sorted({c.family for c in study.cells if _always(study.cells, c.family)})
    return Part(
        "Several contacts with equal e: the two laws agree if and only if some p >= 0 gives IAPB's velocity; "
        f"{against} of {cases} impacts contradict this. They agreed in every impact of these families: "
        f"{', '.join(whole)}.",
        _all(c.contradictions == 0 for c in cells), "wider class")  # fmt: skip


def _always(cells: Sequence[MapCell], family: str) -> bool:
    return all(c.agree == 1.0 for c in cells if c.family == family)


def two_contacts(study: ComparisonStudy) -> Part | None:
    """At two contacts the laws agree if and only if r >= c."""
    right = sum(c.predicted == c.found for c in study.two_contacts)
    return Part(
        "Two contacts with approach speeds 1 and r, whose rows have the cosine c in the kinetic metric: the laws agree "
        f"exactly where r >= c, as predicted, on {right} of {len(study.two_contacts)} grid points.",
        _all(c.predicted == c.found for c in study.two_contacts), "two contacts")  # fmt: skip


def difference(study: ComparisonStudy) -> Part | None:
    """The distance of the laws, compared with the distance of IAPB's impulse from the cone of pushing impulses."""
    cells = [c for c in study.cells if c.agree < 1.0]
    if not cells:
        return None
    defect, farthest = max(c.defect for c in study.cells + study.scenes), max(c.farthest for c in cells)
    redundancies = sorted({c.redundancy for c in cells})
    apart = {r: 100.0 * (1.0 - np.mean([c.agree for c in cells if c.redundancy == r])) for r in redundancies}
    return Part(
        f"Where the laws differ, their distance equals that of IAPB's impulse from the cone of pushing impulses (to "
        f"{defect:.0e}); it is at most {farthest:.2g} |v⁻|. The distance is proportional to 1 + e; whether an impact "
        "differs does not depend on e. Share of impacts that differ, by number of redundant rows: "
        f"{', '.join(f'{r}: {share:.0f} %' for r, share in apart.items())}.",
        _all(c.defect <= CONE_TOLERANCE for c in study.cells + study.scenes), "difference")  # fmt: skip


def energy(study: ComparisonStudy) -> Part | None:
    """The energy that IAPB loses beyond the LCP's loss, and the momentum residual."""
    cells = study.cells + study.scenes
    extra, momentum = 100 * max(c.extra_loss for c in cells), max(c.momentum for c in cells)
    return Part(
        f"IAPB never keeps more energy than the LCP. It loses ½ (1−e)/(1+e) · distance² more, at most {extra:.0f} % of "
        f"KE⁻, and nothing more at e = 1. The change of momentum lies in range(Jᵀ) to {momentum:.0e}.",
        _all(c.least_extra_loss >= -SAME and c.momentum <= MOMENTUM for c in cells), "energy")  # fmt: skip


def scenes(study: ComparisonStudy) -> Part | None:
    """Agreement of the laws on the impacts of the project's scenes."""
    cases = sum(c.cases for c in study.scenes)
    if not cases:
        return None
    apart = sorted({c.family.removeprefix("scene ") for c in study.scenes if c.agree < 1.0})
    pulling = sum(round(c.adhesive * c.cases) for c in study.scenes)
    artefacts = sum(round(c.artefact * c.cases) for c in study.scenes)
    where = f"the laws differ in {', '.join(apart)}" if apart else "the laws agree in all"
    return Part(
        f"Impacts of the project's scenes, each run with its own e and with e = {SCENE_RESTITUTIONS[1]:g}: {cases}; "
        f"{where}. {pulling} impacts need a pulling impulse (no p >= 0 gives their velocity); {artefacts} have one "
        f"only in the least-norm p. {study.left_out} impacts are left out (per-body rows or device limits).",
        REPRODUCED if not apart else MIXED, "scenes")  # fmt: skip


def touching(study: ComparisonStudy) -> Part | None:
    """Erratum 4: contacts that touch without approaching may approach after the impact."""
    cells = [c for c in study.cells if c.family == "with a neighbour"]
    if not cells:
        return None
    ours = 100 * float(np.mean([c.left_approaching for c in cells]))
    theirs = 100 * float(np.mean([c.left_approaching_law for c in cells]))
    return Part(
        "A neighbouring contact that touches without approaching has no row in (19). After the impact it approaches in "
        f"{ours:.0f} % of such impacts with IAPB, and in {theirs:.0f} % with the LCP on the same rows.",
        _by_share(1.0 - float(np.mean([c.left_approaching for c in cells]))), "touching")  # fmt: skip


def piles(study: ComparisonStudy) -> Part | None:
    """Dense piles, in which assumption (i) fails."""
    if not study.piles:
        return None
    agree = [row for row in study.piles if row.agrees]
    limit = max((row.contacts for row in agree), default=0)
    beyond = [row for row in study.piles if row.contacts > limit] or list(study.piles)
    pulling = 100.0 * np.mean([row.pulling for row in beyond])
    against = sum(row.asked is not None and row.asked != row.agrees for row in study.piles)
    own = [row for row in study.piles if not row.name.startswith("recorded")]
    return Part(
        "Dense piles, with every colliding contact as an equality: some p >= 0 gives the velocity of (21) in "
        f"{len(agree)} of {len(study.piles)} impacts, and in none with more than {limit} contacts. Do not use (19) "
        f"where more than {limit} contacts collide at once: there {pulling:.0f} % of the impulses pull, and the "
        f"velocity differs from the LCP's by {np.median([row.distance for row in beyond]):.2g} |v⁻| (median). "
        f"Non-negative least squares contradicts this in {against} impacts. With impulses that only push (method "
        f"\"poisson\", world IAPB-push) the velocity equals the LCP's to {max(row.lcp for row in own):.0e} on the "
        f"project's piles and to {max(row.lcp for row in study.piles):.0e} on all, and the energy changes by at most "
        f"{max(row.gain for row in study.piles):.0e} KE⁻.",
        verdict_of_trials([row.agrees for row in study.piles]), "piles",
        miss=f"beyond {limit} contacts at once {pulling:.0f} % of IAPB's impulses pull")  # fmt: skip


def references(study: ComparisonStudy) -> Part | None:
    """Differences of the engine from the independent reference implementations."""
    rows = study.differences
    if not rows:
        return None
    mass, inner, gap = (max(rows, key=attrgetter(name)) for name in ("mass_matrix", "inner_forces", "gap"))
    apart = sum(row.apart for row in rows)
    return Part(
        f"The references compute M and B + G with Pinocchio and contacts in closed form. On {len(rows)} scenes the "
        f"engine differs from them by at most {mass.mass_matrix:.0e} of the largest entry in M ({mass.scene}), "
        f"{inner.inner_forces:.0e} in B + G ({inner.scene}) and {gap.gap:.0e} m in the gaps ({gap.scene}). In {apart} "
        f"of {sum(row.configurations for row in rows)} configurations the sets of contacts differ, for example where "
        "two faces are equally deep.",
        _all(max(row.mass_matrix, row.inner_forces, row.gap) <= SAME_MECHANICS for row in rows),
        "references")  # fmt: skip


def friction(study: ComparisonStudy) -> Part | None:
    """Impacts with dry friction, compared with Coulomb's NCP and its relaxation CCP."""
    cells = study.friction
    pushing, same = sum(c.pushing for c in cells), sum(c.same for c in cells)
    ours, ncp, ccp = (max(getattr(c, f"largest_gain{law}") for c in cells) for law in ("", "_ncp", "_ccp"))
    bouncing = [c for c in cells if c.restitution > 0.0]
    share = 100 * sum(c.ncp_gains for c in bouncing) / max(1, sum(c.cases for c in bouncing))
    return Part(
        "Friction in the impact: where every contact pushes, IAPB's velocity equals that of Coulomb's law (nonlinear "
        f"complementarity problem, NCP) in {same} of {pushing} impacts. With e > 0 the NCP gains energy in {share:.0f} "
        f"% of the impacts, up to {ncp:.2g} KE⁻; its convex relaxation (CCP) gains up to {ccp:.2g} KE⁻. IAPB never "
        f"gains energy (largest change {ours:.0e} KE⁻).",
        REFUTED if any(c.largest_gain > GAIN for c in cells) else _by_share(same / max(1, pushing)),
        "friction")  # fmt: skip


def unequal(study: ComparisonStudy) -> Part | None:
    """Impacts with unequal restitution: energy gains, and agreement with the reference's Poisson law."""
    distance = max(c.distance for c in study.unequal)
    ours, newton, equality = (
        max(getattr(c, name) for c in study.unequal) for name in ("gain", "gain_newton_lcp", "gain_equality")
    )
    before, after = study.bar["newton_equality"], study.bar["IAPB, unequal restitution"]
    return Part(
        f"Unequal restitution: the engine's two LCPs agree with the reference's to {distance:.0e} and gain at most "
        f"{ours:.0e} KE⁻. Equalities gain up to {equality:.2g} KE⁻, the Newton LCP up to {newton:.2g} KE⁻ where some "
        f"contacts separate. The struck bar has 0.5 J before the impact, {before:.4g} J after it with equalities and "
        f"{after:.4g} J with IAPB.",
        _all(c.distance <= SAME_LAW and c.gain <= GAIN for c in study.unequal), "unequal")  # fmt: skip


def ideal_world(study: ComparisonStudy) -> Part | None:
    """Convergence of the rigid world to the event-driven solution."""
    rows = study.convergence
    if not rows:
        return None
    apart = [row.scene for row in rows if not row.first_order]
    place = f"not on {', '.join(apart)}" if apart else "on all"
    more = f" ({len(CASES) - len(rows)} more with --full)" if len(rows) < len(CASES) else ""
    orders = [order for row in rows for order in (row.position_order, row.velocity_order) if np.isfinite(order)]
    return Part(
        f"The ideal world converges to the event-driven solution at first order {place} of {len(rows)} scenes{more}: "
        f"measured orders {min(orders):.2f} to {max(orders):.2f}, median {np.median(orders):.2f} (positions in the sup "
        f"norm, velocities in L¹). No event-driven solution exists for {', '.join(WITHOUT_TRUTH)}.",
        verdict_of_trials([row.first_order for row in rows]), "ideal world")  # fmt: skip


def cost(study: ComparisonStudy) -> Part | None:
    """Claim C22: time per impact."""
    found = []
    for called in ("compiled", "from Python"):
        pairs = [pair for pair in rivals(study.impact_costs) if pair.called == called]
        decided = [pair for pair in pairs if pair.costs_more is not None]
        more = sum(bool(pair.costs_more) for pair in decided)
        found.append(f"{called}, a solver takes longer than IAPB in {more} of the {len(decided)} pairs of solver and "
                     "impact whose times differ clearly")
    costs = study.impact_costs
    sizes = costs.column("contacts")
    parts = [_cost_part(costs.where(impacts=family, contacts=contacts), family, contacts)
             for family in dict.fromkeys(costs.column("impacts")) for contacts in sorted({min(sizes), max(sizes)})]
    return Part(f"C22, time per impact, by every solver at {len(set(sizes))} sizes (claim C22 itself compares the two "
                f"kernels at more sizes): {'; '.join(found)}. Medians: {'; '.join(parts)}.",
                verdict_of_trials([pair.costs_more for pair in rivals(study.impact_costs)]),
                "cost", timed=True)  # fmt: skip


def _cost_part(costs: Table, family: str, contacts: int) -> str:
    here = {row["solver"]: row for row in costs.records()}
    times = {name: _seconds(1e-6 * row["median"]) for name, row in here.items() if row["median"] is not None}
    solved = [name for name in times if here[name]["outcome"] == "solved"]
    others = [name for name in solved if name not in (IAPB, KERNEL, PRINTED, LEMKE_KERNEL)]
    noun = "contact" if contacts == 1 else "contacts"
    text = f"{family} of {contacts} {noun}: IAPB {times[KERNEL]} compiled, {times[IAPB]} from Python"
    if LEMKE_KERNEL in solved:
        text += f", Lemke {times[LEMKE_KERNEL]} compiled"
    if not others:
        return text + ", no LCP solver called from Python solved it"
    best = min(others, key=lambda name: here[name]["median"])
    return text + f", fastest solver from Python {best} {times[best]}"


def steps(study: ComparisonStudy) -> Part | None:
    """Claim C22: time per step."""
    parts = []
    for scene in dict.fromkeys(study.step_costs.column("scene")):
        here = study.step_costs.where(scene=scene).records()
        parts.append(f"{scene}: " + ", ".join(f"{row['world']} {row['median']:.3g}" for row in here if
                                              row["world"] != COMPILED))
    if not parts:
        return None
    return Part("C22, time per step as a multiple of IAPB's in its compiled loop: " + "; ".join(parts) + ".",
                verdict_of_trials([costs_more(*pair) for pair in step_rivals(study.step_costs)]), "steps",
                timed=True)  # fmt: skip


def problems(study: ProblemStudy) -> tuple[Part, ...]:
    """One folder of problem files: which problems are solved, by which solvers, and whether their solutions agree."""
    counts = ", ".join(
        f"{name} {study.count(name, 'solved')}/{study.count(name, 'refused')}/{study.count(name, 'failed')}"
        for name in study.solvers
    )
    skew = [f"{line.problem} ({line.asymmetry:.1g})" for line in study.lines if line.asymmetry > 0.0]
    unsolved = [line.problem for line in study.lines if all(verdict != "solved" for _, verdict in line.verdicts)]
    smooth, rough = _spread(study, 0), _spread(study, 1)
    found = [
        f"{study.folder[:1].upper()}{study.folder[1:]}: {len(study.lines)} problems read, {len(study.unread)} files "
        f"not readable. Problems solved/refused/failed, judged by recomputed residuals: {counts}." + _left_out(study),
        f"Problems that no solver solves: {', '.join(unsolved) or 'none'}. The solvers that solve a frictionless "
        f"problem agree on its contact velocities to {smooth:.0e} (impulses are not unique and not compared)"
        + (f"; with friction, where Coulomb's law does not make velocities unique, to {rough:.0e}." if rough else "."),
    ]
    alone = [f"{line.problem} ({solved[0]})" for line in study.lines
             if len(solved := [name for name, verdict in line.verdicts if verdict == "solved"]) == 1]  # fmt: skip
    if alone:
        found.append(f"Problems that only one solver solves: {', '.join(alone)}.")
    if study.unread:
        found.append(f"Files not readable: {'; '.join(file.reason for file in study.unread)}.")
    if skew:
        found.append(f"Problems with an asymmetric W (asymmetry relative to the largest entry): {', '.join(skew)}.")
    # timed, because a solver that was too slow on a smaller problem is left out
    verdict = MIXED if unsolved or study.unread else REPRODUCED
    return tuple(Part(sentence, verdict, "problems", timed=True) for sentence in found)


def _spread(study: ProblemStudy, friction: int) -> float:
    """Largest spread of contact velocities among the problems without (0) or with friction (1)."""
    spreads = [line.spread for line in study.lines if line.friction == bool(friction)]
    return max((spread for spread in spreads if np.isfinite(spread)), default=0.0)


def _left_out(study: ProblemStudy) -> str:
    """Return a sentence on the pairs of solver and problem that the time limit left out."""
    count = sum(row.verdict == "left out" for row in study.rows)
    said = f" {count} pairs of solver and problem were left out: the solver was too slow on a smaller problem."
    return said if count else ""


def _seconds(value: float) -> str:
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if value * factor >= 1.0 or unit == "µs":
            return f"{value * factor:.3g} {unit}"
    return f"{value:.3g} s"


def _all(outcomes: Iterable[bool]) -> str:
    """Return the verdict of an exact statement: a single exception refutes it."""
    found = list(outcomes)
    return NOT_TESTABLE if not found else REPRODUCED if all(found) else REFUTED


def _by_share(share: float) -> str:
    return REPRODUCED if share == 1.0 else MIXED if share >= 0.5 else REFUTED


# In the order of the report.
PARTS: dict[str, Callable[[ComparisonStudy], Part | None]] = {
    make.__name__: make
    for make in (single_contact, wider_class, two_contacts, difference, energy, scenes, touching, piles, friction,
                 unequal, ideal_world, references, cost, steps)
}  # fmt: skip
