"""`check_passivity(resolver)` tests whether an impact resolver ever creates energy and whether it
keeps the other laws."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from importlib.util import find_spec
from inspect import signature
from operator import itemgetter
from typing import Any, Self

import numpy as np

from iapb.errors import ArgumentError, MissingDependencyError, installing
from iapb.names import one_of
from reference.one_thread import one_thread
from verification.impacts import (
    LARGE_CONTACTS,
    LARGE_COORDINATES,
    LARGE_EVERY,
    ImpactCase,
    with_unequal_restitution,
)
from verification.laws.bounds import KIT, Bounds, Law, LawCount
from verification.laws.child import Child, child_of
from verification.laws.contracts import CONTRACTS, EXACT_LAWS, OF_VARIANTS
from verification.laws.counterexample import (
    HANGS,
    NOTABLE,
    Counterexample,
    Hunt,
    as_test,
    kind_of,
    name_of,
    residual_of,
)
from verification.laws.equality import OF_ONE_CALL, UNEQUAL_LAWS
from verification.laws.resolver import Resolver, Watched

IMPACTS = 5000  # default: about a minute for a resolver that takes 50 µs per call
PATIENCE = 600.0  # [s] ten times as long
CALL_LIMIT = 60.0  # [s]
SHRINKING = 60.0  # [s] for a counterexample
LITTLE_TIME = 2.0  # [s] for it where the patience is at its end
ITERATED = 1e-4  # largest residual that the accuracy of an iteration may explain
_HINT = (
    "No error is above {wider}, which an iteration that ends early can explain. Widen the "
    "tolerances: bounds=dataclasses.replace(verification.laws.bounds.{table}, least={wider}, "
    "restitution={wider}). Errors below {wider} of v are not noticed then"
)


@dataclass
class Breaks:
    """The impacts that break a law in one way: by an answer, or for want of a usable one.

    Attributes
    ----------
    fault : what the resolver did for want of an answer, else "".
    first, calls : the first of the impacts, and the pickled arguments of the calls until then.
    drawn : with their residuals, the simplest of them and the one with the largest residual. The
        simplest has the fewest coordinates and contacts; a residual of NOTABLE or more comes first.
    """

    fault: str
    first: ImpactCase
    calls: list[bytes]
    drawn: list[tuple[float, ImpactCase]]

    def add(self, value: float, case: ImpactCase) -> None:
        """Take one more impact with its residual into account."""
        every = [*self.drawn, (value, case)]
        self.drawn = [min(every, key=_simplicity), max(every, key=itemgetter(0))]


def _simplicity(drawn: tuple[float, ImpactCase]) -> tuple[bool, int]:
    value, case = drawn
    return value < NOTABLE, case.coordinates + case.contacts


@dataclass
class LawVerdict(LawCount):
    """Verdict on one law over all impacts.

    Attributes
    ----------
    checked, failures : impacts the law applied to, and those that broke it.
    worst : the residual with the largest value / tolerance (None if the law never applied).
    breaks : the impacts that break the law, by whether a usable answer was missing.
    error : exception that the law itself raised, after which it was not tried again; else None.
    """

    statement: str = ""
    worst_case: ImpactCase | None = None
    breaks: dict[bool, Breaks] = field(default_factory=dict, repr=False)
    error: Exception | None = None

    @property
    def passed(self) -> bool:
        """Whether no impact broke the law and the law itself raised no exception."""
        return self.failures == 0 and self.error is None

    @property
    def largest(self) -> float:
        """Largest residual of an answer that breaks the law, whatever its tolerance; 0 if none
        does."""
        return self.breaks[False].drawn[-1][0] if False in self.breaks else 0.0

    @property
    def fault(self) -> str:
        """What the law itself raised, or what the resolver did for want of an answer; else ""."""
        if self.error is not None:
            return f"the law itself raised {type(self.error).__name__}: {self.error}"
        return self.breaks[True].fault if True in self.breaks else ""

    def __str__(self) -> str:
        mark = "kept  " if self.passed else "BROKEN"
        worst = f"worst {self.worst.words}" if self.worst else "-"
        line = f"  {mark} {self.statement}: {self.failures} of {self.checked} impacts break it, {worst}"
        return f"{line}\n         {self.fault}" if self.fault else line

    def try_on(self, law: Law, case: ImpactCase, resolver: Watched, bounds: Bounds) -> None:
        """Try the law on one impact; a law that raises an exception is not tried again."""
        if self.error is not None:
            return
        try:
            residual, fault = residual_of(law, case, resolver, bounds)
        except Exception as error:
            self.error = error
            return
        if residual is None:
            return
        passed = self.add(residual)
        if self.worst is residual:
            self.worst_case = case
        if passed:
            return
        known = self.breaks.get(bool(fault))
        if known is None:
            drawn = [(residual.value, case)]
            self.breaks[bool(fault)] = Breaks(fault, case, list(resolver.calls), drawn)
        elif not fault:
            known.add(residual.value, case)


class Report(str):
    """Report of a check. It is a string with its own text, because pytest shortens other assert
    messages."""

    verdicts: tuple[Any, ...]
    unfinished: str

    def __new__(cls, *fields: Any, **named: Any) -> Self:
        """Make the string from the text of the fields."""
        draft = str.__new__(cls)
        draft.__init__(*fields, **named)  # type: ignore[misc]
        return str.__new__(cls, draft._text())

    def __getnewargs__(self) -> tuple[Any, ...]:
        """Arguments that recreate the report in another process."""
        return tuple(getattr(self, one.name) for one in fields(self))  # type: ignore[arg-type]

    __repr__ = __str__ = str.__str__

    @property
    def passed(self) -> bool:
        """Whether every law holds on every requested case."""
        return not self.unfinished and all(verdict.passed for verdict in self.verdicts)

    @property
    def broken_laws(self) -> tuple[str, ...]:
        """Names of the laws that some case broke."""
        return tuple(verdict.law for verdict in self.verdicts if not verdict.passed)

    def raise_if_broken(self) -> None:
        """Raise the report as an error unless it passed; the message contains the
        counterexample.

        Raises
        ------
        AssertionError
            A law is broken, or there was no time to try every case.
        """
        if not self.passed:
            raise AssertionError(str(self))

    def _text(self) -> str:
        """Return what the report prints; each kind of report writes its own text."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False, repr=False)
class PassivityReport(Report):
    """Report of `check_passivity`.

    Attributes
    ----------
    impacts : number of random impacts tried, not counting the contract's fixed first ones.
    unfinished : why fewer impacts were tried than requested; empty if all were tried.
    found : smallest counterexample to the first law that an answer broke, and to the first law for
        which an answer was unusable.
    contract : contract that the resolver was tested against; see `verification.laws.contracts`.
    tested : the resolver, for the import line of the generated test.
    call_limit : [s] limit of one call.
    """

    resolver: str
    impacts: int
    seed: int
    verdicts: tuple[LawVerdict, ...]
    found: tuple[Counterexample, ...] = ()
    unfinished: str = ""
    bounds: Bounds = KIT
    tested: Any = None
    contract: str = "equality"
    call_limit: float = CALL_LIMIT

    @property
    def worst(self) -> LawVerdict:
        """The law with the largest value / tolerance."""
        return max(self.verdicts, key=lambda verdict: verdict.worst.ratio if verdict.worst else 0.0)

    def verdict(self, law: str) -> LawVerdict:
        """The verdict on the law of that name."""
        return next(verdict for verdict in self.verdicts if verdict.law == law)

    @property
    def counterexample(self) -> ImpactCase | None:
        """The impact of the first counterexample; None if there is none."""
        return self.found[0].case if self.found else None

    @property
    def counterexample_law(self) -> str:
        """Name of the law that the first counterexample breaks; "" if there is none."""
        return self.found[0].law if self.found else ""

    @property
    def counterexample_test(self) -> str:
        """The first counterexample as source code of a test, or an empty text if there is none."""
        return self.test_of(self.found[0]) if self.found else ""

    def test_of(self, one: Counterexample) -> str:
        """Return a counterexample as source code of a test."""
        limit = self.call_limit if kind_of(one.fault) == HANGS else np.inf
        return as_test(
            one.case, one.law, self.bounds, self.tested, self.contract, one.earlier, limit
        )

    @property
    def hint(self) -> str:
        """What to do if all errors are as small as those of an iteration that ends early."""
        largest = max(one.largest for one in self.verdicts)
        if not 0.0 < largest < ITERATED or any(True in one.breaks for one in self.verdicts):
            return ""
        wider = 10.0 ** np.ceil(np.log10(largest))
        table = "KIT" if self.contract == "equality" else "ONE_SIDED"
        return _HINT.format(table=table, wider=f"{wider:.0e}")

    def _text(self) -> str:
        word = "passed" if self.passed else "NOT FINISHED" if not self.broken_laws else "FAILED"
        kind = "" if self.contract == "equality" else f", contract {self.contract}"
        lines = [f"{self.resolver}: {word} on {self.impacts} impacts{kind}"]
        if self.unfinished:
            lines.append(f"  {self.unfinished}")
        lines += [str(verdict) for verdict in self.verdicts]
        if self.passed and CONTRACTS[self.contract].unjudged:
            lines.append(f"  not judged: {CONTRACTS[self.contract].unjudged}")
        worst = self.worst
        if worst.worst is not None and worst.worst_case is not None:
            family = worst.worst_case.family or "an impact"
            lines.append(
                f"  worst case: {worst.law} at {worst.worst.ratio:.2g} of its tolerance, {family}"
            )
        if self.hint:
            lines.append(f"  hint: {self.hint}")
        for one in self.found:
            lines += ["", f"{one.title}:", *_shown(one), "", "as a test:", "", self.test_of(one)]
        return "\n".join(lines)


def _shown(one: Counterexample) -> Iterator[str]:
    """Yield lines with the arguments and the answer of each call that the law makes."""
    calls = one.calls or ((one.case.given(), one.fault),)
    for number, (given, answer) in enumerate(calls, 1):
        if len(calls) > 1:
            yield f"call {number} of {len(calls)} that the law makes:"
        names = ("M", "J", "v", "e") if len(given) == 4 else ("M", "J", "T", "v", "e", "μ")
        for name, value in zip((*names, "returned"), (*given, answer), strict=True):
            lead = f"  {name} = "
            text = value
            if not isinstance(value, str):
                text = np.array2string(np.asarray(value), precision=9, threshold=400)
            yield lead + text.replace("\n", "\n" + " " * len(lead))


def check_passivity(
    resolver: Resolver,
    *,
    contract: str = "equality",
    laws: Sequence[str] | None = None,
    impacts: int = IMPACTS,
    seed: int = 0,
    search: int = 200,
    bounds: Bounds | None = None,
    largest_condition: float | None = None,
    unequal_restitution: bool = False,
    patience: float = PATIENCE,
    call_limit: float = CALL_LIMIT,
    own_process: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> PassivityReport:
    """Run the laws of a contract against `resolver` and return the report.

    Parameters
    ----------
    resolver : called as resolver(mass_matrix (d, d), contact_jacobian (c, d), velocity (d,),
        restitution) with float64 arrays (copies; c = 0 included) and one e for all rows; returns v⁺
        as an array, a list of numbers, or an object with `.velocity`.
    contract : ``equality``: every row is an equality, e in [−1, 1]. ``unilateral``: contacts only
        push, e in [0, 1]. ``frictional``: also Coulomb's friction; called as resolver(mass_matrix,
        contact_jacobian, tangents (c, m, d), velocity, restitution, friction (c,)), m = 1 or 2.
        Equations and sources: `verification.laws.contracts`.
    laws : names of the laws to try, such as ["kinetic_energy"]; default: all of the contract except
        ``exact_energy``, which allows no rounding error.
    impacts : number of random impacts. ``equality``: up to 10 coordinates and 21 contacts; one
        impact in ten has up to 40 coordinates and 500 contacts, and fewer laws check it. Half of
        the impacts use other units: M, J and v are multiplied by powers of two from 1e-8 to 1e8.
        `impacts.ADVERSE` elastic impacts on nearly equal rows come first, in addition. Other
        contracts: up to 6 coordinates and 6 contacts, no nearly dependent rows.
    seed : seed of the random numbers; the same seed gives the same impacts.
    search : number of examples that hypothesis may try to find and shrink a counterexample (0 =
        shrink a drawn one).
    bounds : tolerances; default: those of the contract, from `verification.laws.bounds`.
    largest_condition : largest κ(M) drawn; default: 1e8 (``equality``), 1e4 (``unilateral``), 1e2
        (``frictional``).
    unequal_restitution : also call the resolver with an array (c,) of restitutions in [0, 1], one
        per row, and test the laws that hold for every such rule: no energy gain, M(v⁺ − v⁻) in
        range(Jᵀ), momentum, repeatable bits, unchanged arguments.
    patience : time limit [s] after which no further impact is tried; the report then fails and says
        why.
    call_limit : time limit [s] of one call in a process of its own.
    own_process : whether the resolver is called in a process of its own. A call that takes longer
        than `call_limit` is then ended and breaks the laws, as does one that ends the process. Each
        call takes 0.1 to 0.3 ms longer, and what the resolver remembers is not seen here.
    progress : called with (impacts done, impacts) after each impact, then with (seconds, most
        seconds) while a counterexample is searched.

    Returns
    -------
    PassivityReport
        `passed`, each law with its worst case, and the smallest counterexample found, also as a
        test to paste.

    Raises
    ------
    ArgumentError
        No impacts, an unknown contract or law, unequal restitution with friction, or a resolver
        that cannot be called with these arguments.

    Notes
    -----
    The kit finds a fault that n independent draws meet with probability p each with probability 1 −
    (1 − p)ⁿ. `docs/resolvers.md` lists n, which depends on what the fault depends on, and the
    faults that the kit cannot see.

    Examples
    --------
    >>> def test_my_resolver():
    ...     check_passivity(my_resolver, contract="unilateral").raise_if_broken()
    """
    ends = time.monotonic() + patience
    chosen = choose_laws(contract, laws, unequal_restitution)
    for name, count, least in (("impacts", impacts, 1), ("seed", seed, 0)):
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < least:
            raise ArgumentError(name, count, f"a whole number, {least} or more")
    if not 0.0 < call_limit < np.inf:
        raise ArgumentError("call_limit", call_limit, "seconds above 0")
    _refuse_signature(resolver, contract)
    _find_hypothesis()
    terms = CONTRACTS[contract]
    bounds = terms.bounds if bounds is None else bounds
    condition = terms.largest_condition if largest_condition is None else largest_condition
    verdicts = {name: LawVerdict(name, statement=law.statement) for name, law in chosen.items()}
    # this loads the solver that the draws use, so that fresh resolvers need not
    terms.draw(np.random.default_rng(seed), 0, condition)
    with one_thread(), child_of(resolver, call_limit) as child:
        if own_process and child is None:
            raise ArgumentError("own_process", True, "False where no process can be forked")
        watched = Watched(child if own_process and child else resolver)
        trial = _Trial(
            resolver=resolver,
            child=child,
            watched=watched,
            contract=contract,
            laws=chosen,
            verdicts=verdicts,
            bounds=bounds,
            impacts=int(impacts),
            seed=seed,
            largest_condition=condition,
            search=search,
            ends=ends,
            progress=progress,
        )
        done = trial.try_all()
        found = tuple(trial.counterexamples())
        watched.forget()
    late = "" if done == impacts else f"too slow: {done} of {impacts} impacts in {patience:g} s"
    return PassivityReport(
        name_of(resolver),
        done,
        seed,
        tuple(verdicts.values()),
        found,
        late,
        bounds,
        resolver,
        contract,
        call_limit,
    )


def _find_hypothesis() -> None:
    """Refuse at once if hypothesis is missing; only the search for a small counterexample loads
    it."""
    try:
        if find_spec("hypothesis") is not None:
            return
    except ModuleNotFoundError:
        pass
    raise MissingDependencyError("hypothesis", "verification.check_passivity", installing("verify"))


def _refuse_signature(resolver: Resolver, contract: str) -> None:
    """Raise ArgumentError if the resolver cannot be called with the arguments of the contract."""
    friction = contract == "frictional"
    wanted = (
        "mass_matrix",
        "contact_jacobian",
        *["tangents"] * friction,
        "velocity",
        "restitution",
        *["friction"] * friction,
    )
    try:
        signature(resolver).bind(*wanted)
    except TypeError as error:
        raise ArgumentError(
            "resolver", name_of(resolver), f"a function called as ({', '.join(wanted)}): {error}"
        ) from None
    except ValueError:  # a compiled function may have no signature
        return


def choose_laws(
    contract: str, laws: Sequence[str] | None, unequal_restitution: bool = False
) -> dict[str, Law]:
    """Return the laws of a contract by name: those in `laws`, or all but the optional ones if
    `laws` is None.

    Raises
    ------
    ArgumentError
        The contract has no law of that name; the message lists the laws that it has.
    """
    if contract not in CONTRACTS:
        raise ArgumentError("contract", contract, one_of(contract, CONTRACTS))
    if unequal_restitution and contract == "frictional":
        raise ArgumentError("unequal_restitution", True, "False with contract 'frictional'")
    known = CONTRACTS[contract].laws | (UNEQUAL_LAWS if unequal_restitution else {})
    if laws is None:
        return {name: law for name, law in known.items() if name not in EXACT_LAWS}
    return laws_named(known, laws)


def laws_named(known: dict[str, Law], laws: Sequence[str]) -> dict[str, Law]:
    """Return the laws of these names; an error lists the known ones."""
    if not isinstance(laws, Iterable):
        raise ArgumentError("laws", laws, "names of laws")
    names = [laws] if isinstance(laws, str) else list(laws)
    for name in names:
        if name not in known:
            raise ArgumentError("laws", name, one_of(name, known))
    if not names:
        raise ArgumentError("laws", laws, one_of("", known, "at least one of "))
    return {name: law for name, law in known.items() if name in names}


@dataclass
class _Trial:
    """One check: the resolver, the laws that are tried with their verdicts so far, and the search
    for counterexamples.

    child : makes fresh resolvers; None where no process can be forked.
    watched : answers the calls of the laws: the resolver, or its child.
    """

    resolver: Resolver
    child: Child | None
    watched: Watched
    contract: str
    laws: dict[str, Law]
    verdicts: dict[str, LawVerdict]
    bounds: Bounds
    impacts: int
    seed: int
    largest_condition: float
    search: int
    ends: float
    progress: Callable[[int, int], None] | None

    def try_law(self, name: str, case: ImpactCase) -> None:
        """Try a law on an impact, if the law was chosen."""
        if name in self.laws:
            self.verdicts[name].try_on(self.laws[name], case, self.watched, self.bounds)

    def try_all(self) -> int:
        """Check every impact against its laws; return the number of random impacts tried within the
        time limit."""
        rng = np.random.default_rng([self.seed, 3])
        for done, case, mixed in self.drawn():
            large = case.coordinates >= LARGE_COORDINATES[0] or case.contacts >= LARGE_CONTACTS[0]
            for k, name in enumerate(self.laws):
                # of the laws that need more than one call, a large impact is checked by one in turn
                if (
                    large
                    and name.removeprefix("unequal_") not in OF_ONE_CALL
                    and (done // LARGE_EVERY - k) % len(self.laws)
                ):
                    continue
                if time.monotonic() > self.ends:
                    return max(0, done - 1)
                own = mixed if name in UNEQUAL_LAWS else case
                # every second law with variants takes an impact of its own: a band of e, μ or κ is
                # met several times
                if name in OF_VARIANTS and (done + k) % 2 and not large:
                    own = self.another(rng)
                    for single in OF_ONE_CALL:
                        self.try_law(single, own)
                self.try_law(name, own)
            for suspect, v_plus in self.watched.suspects:
                if suspect is not case and suspect is not mixed:  # judged by their own laws
                    self.judge_energy(suspect, v_plus)
            self.watched.suspects.clear()
            if self.progress is not None and done > 0:
                self.progress(done, self.impacts)
        return self.impacts

    def another(self, rng: np.random.Generator) -> ImpactCase:
        """Return one more impact of the contract, not a large one, with any restitution."""
        terms = CONTRACTS[self.contract]
        number = int(rng.integers(1 << 30))
        number += number % LARGE_EVERY == LARGE_EVERY // 2
        case = terms.draw(rng, number, self.largest_condition)
        return replace(case, restitution=float(rng.uniform(terms.least_restitution, 1.0)))

    def judge_energy(self, case: ImpactCase, v_plus: Any) -> None:
        """Check the energy of an answer that another law got for a variant of an impact, without
        another call."""
        own = replace(case, family=f"{case.family}, a variant of it that another law tried")
        own._answers[id(self.watched)] = self.watched, (v_plus, 0)
        self.try_law("kinetic_energy" if case.unequal is None else "unequal_kinetic_energy", own)

    def drawn(self) -> Iterator[tuple[int, ImpactCase, ImpactCase]]:
        """Yield (number, impact, variant with unequal restitutions): the contract's fixed impacts
        have number 0, the random ones count from 1. Without a law of unequal restitution the
        variant is the impact itself.
        """
        terms = CONTRACTS[self.contract]
        unequal = any(name in UNEQUAL_LAWS for name in self.laws)
        seed = self.seed
        rng, other, adverse = (np.random.default_rng(own) for own in (seed, [seed, 1], [seed, 2]))
        for case in terms.first(adverse):
            yield 0, case, with_unequal_restitution(adverse, case) if unequal else case
        for number in range(self.impacts):
            case = terms.draw(rng, number, self.largest_condition)
            yield number + 1, case, with_unequal_restitution(other, case) if unequal else case

    def counterexamples(self) -> Iterator[Counterexample]:
        """Yield a counterexample to the first law that an answer broke, and one to the first law
        for which the resolver gave no usable answer."""
        for without_answer in (False, True):
            for law, verdict in self.verdicts.items():
                if without_answer in verdict.breaks:
                    yield self.counterexample(law, verdict.breaks[without_answer])
                    break

    def counterexample(self, law: str, breaks: Breaks) -> Counterexample:
        """Return the smallest counterexample that hypothesis or the drawn impacts give, shrunk."""
        kind = kind_of(breaks.fault)
        if kind == HANGS:
            return Counterexample(breaks.first, law, breaks.fault)
        began = time.monotonic()
        seconds = min(SHRINKING, max(LITTLE_TIME, self.ends - began))

        def tell() -> None:
            if self.progress is not None:
                spent = min(time.monotonic() - began, seconds)
                self.progress(int(spent), int(seconds))

        hunt = Hunt(
            self.laws[law], kind, self.bounds, self.resolver, self.child, began + seconds, tell
        )
        impacts = "unequal" if law in UNEQUAL_LAWS else self.contract

        def search(fails: Callable[[ImpactCase], bool]) -> ImpactCase | None:
            from verification.laws.strategies import search_counterexample  # brings hypothesis

            return search_counterexample(fails, self.search, self.seed, impacts)

        drawn = [case for _, case in breaks.drawn]
        case = hunt.smallest(drawn, search if self.search else lambda fails: None)
        earlier = tuple[bytes, ...]()
        later = None if case else hunt.after_calls(breaks.first, breaks.calls)
        if later is not None:
            case, earlier = later
        fresh = None
        if self.child is not None and (case is not None or time.monotonic() < hunt.ends):
            fresh = case is not None
        case = drawn[0] if case is None else case
        calls = hunt.calls_for(case, earlier)
        return Counterexample(case, law, breaks.fault, calls, earlier, fresh)
