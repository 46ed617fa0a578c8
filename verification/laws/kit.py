"""`check_passivity(resolver)` tests whether an impact resolver ever creates energy and whether it
keeps the other laws."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from importlib.util import find_spec
from inspect import signature
from typing import Any, NamedTuple, Self

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
from verification.laws.contracts import CONTRACTS, EXACT_LAWS, OF_VARIANTS, Contract
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


@dataclass
class LawVerdict(LawCount):
    """Verdict on one law over all impacts.

    Attributes
    ----------
    checked, failures : impacts the law applied to, and those that broke it.
    worst : the residual with the largest value / tolerance (None if the law never applied).
    largest : largest value of the residual, whatever its tolerance.
    largest_case : the impact that breaks the law with the largest residual; None if no impact
        breaks it.
    smallest_case : the impact with the fewest coordinates and contacts that breaks the law; impacts
        with a residual of 1e-6 or more take precedence.
    fault : first message if the resolver raised an exception or returned an unusable value.
    fault_case : the impact of this message; the other cases are those of usable answers.
    first_calls : by `fault_case` or not, the first impact that broke the law, and the pickled
        arguments of the calls until then.
    error : exception that the law itself raised, after which it was not tried again; else None.
    """

    statement: str = ""
    worst_case: ImpactCase | None = None
    largest: float = -np.inf
    largest_case: ImpactCase | None = None
    fault: str = ""
    error: Exception | None = None
    smallest_case: ImpactCase | None = None
    fault_case: ImpactCase | None = None
    first_calls: dict[bool, tuple[ImpactCase, list[bytes]]] = field(
        default_factory=dict, repr=False
    )
    _largest_failure: float = field(default=-np.inf, repr=False)
    # whether it is below NOTABLE, and its size
    _smallest: tuple[bool, int] = field(default=(True, 0), repr=False)

    @property
    def passed(self) -> bool:
        """Whether no impact broke the law and the law itself raised no exception."""
        return self.failures == 0 and self.error is None

    def __str__(self) -> str:
        mark = "kept  " if self.passed else "BROKEN"
        worst = f"worst {self.worst.words}" if self.worst else "-"
        line = f"  {mark} {self.statement}: {self.failures} of {self.checked} impacts break it, {worst}"
        return f"{line}\n         {self.fault}" if self.fault else line

    def try_on(self, law: Law, case: ImpactCase, resolver: Resolver, bounds: Bounds) -> None:
        """Try the law on one impact; a law that raises an exception is not tried again."""
        if self.error is not None:
            return
        try:
            residual, complaint = residual_of(law, case, resolver, bounds)
        except Exception as error:
            self.error = error
            self.fault = f"the law itself raised {type(error).__name__}: {error}"
            return
        if residual is None:
            return
        passed = self.add(residual)
        if self.worst is residual:
            self.worst_case = case
        self.largest = max(self.largest, residual.value)
        if passed:
            return
        if bool(complaint) not in self.first_calls and isinstance(resolver, Watched):
            self.first_calls[bool(complaint)] = case, list(resolver.calls)
        if complaint:
            if self.fault_case is None:
                self.fault = complaint
                self.fault_case = case
            return
        if self.largest_case is None or residual.value > self._largest_failure:
            self._largest_failure = residual.value
            self.largest_case = case
        size = residual.value < NOTABLE, case.coordinates + case.contacts
        if self.smallest_case is None or size < self._smallest:
            self._smallest = size
            self.smallest_case = case


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
        largest = max((one.largest for one in self.verdicts if not one.passed), default=0.0)
        if not 0.0 < largest < ITERATED:
            return ""
        wider = 10.0 ** np.ceil(np.log10(largest))
        table = "KIT" if self.contract == "equality" else "ONE_SIDED"
        return (
            f"No error is above {wider:.0e}, which an iteration that ends early can explain. "
            "Widen the tolerances: bounds=dataclasses.replace(verification.laws.bounds."
            f"{table}, least={wider:.0e}, restitution={wider:.0e}). "
            f"Errors below {wider:.0e} of v are not noticed then"
        )

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
        trial = _Trial(watched, bounds, terms, int(impacts), seed, condition, chosen, verdicts)
        done = _try_all(trial, ends, progress)
        hunts = _Hunts(trial, resolver, child, search, contract, ends, progress)
        found = tuple(_counterexamples(hunts))
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


class _Trial(NamedTuple):
    """A resolver, the impacts that it gets, the laws that are tried, and their verdicts so far."""

    resolver: Watched
    bounds: Bounds
    contract: Contract
    impacts: int
    seed: int
    largest_condition: float
    laws: dict[str, Law]
    verdicts: dict[str, LawVerdict]


def _try_all(trial: _Trial, ends: float, progress: Callable[[int, int], None] | None) -> int:
    """Check every impact against its laws; return the number of random impacts tried within the
    time limit."""
    watched = trial.resolver
    rng = np.random.default_rng([trial.seed, 3])
    for done, case, mixed in _drawn(trial):
        large = case.coordinates >= LARGE_COORDINATES[0] or case.contacts >= LARGE_CONTACTS[0]
        for k, name in enumerate(trial.laws):
            # of the laws that need more than one call, a large impact is checked by one in turn
            if (
                large
                and name.removeprefix("unequal_") not in OF_ONE_CALL
                and (done // LARGE_EVERY - k) % len(trial.laws)
            ):
                continue
            if time.monotonic() > ends:
                return max(0, done - 1)
            own = mixed if name in UNEQUAL_LAWS else case
            # every second law with variants takes an impact of its own: a band of e, μ or κ is met
            # several times
            if name in OF_VARIANTS and (done + k) % 2 and not large:
                number = int(rng.integers(1 << 30))
                number += number % LARGE_EVERY == LARGE_EVERY // 2  # no large impact
                own = replace(
                    trial.contract.draw(rng, number, trial.largest_condition),
                    restitution=float(rng.uniform(trial.contract.least_restitution, 1.0)),
                )
                for single in OF_ONE_CALL:
                    if single in trial.laws:
                        trial.verdicts[single].try_on(
                            trial.laws[single], own, watched, trial.bounds
                        )
            trial.verdicts[name].try_on(trial.laws[name], own, watched, trial.bounds)
        for suspect, v_plus in watched.suspects:
            if suspect is not case and suspect is not mixed:  # judged by their own laws
                _judge_energy(trial, suspect, v_plus)
        watched.suspects.clear()
        if progress is not None and done > 0:
            progress(done, trial.impacts)
    return trial.impacts


def _judge_energy(trial: _Trial, case: ImpactCase, v_plus: Any) -> None:
    """Check the energy of an answer that another law got for a variant of an impact, without
    another call."""
    own = replace(case, family=f"{case.family}, a variant of it that another law tried")
    own._answers[id(trial.resolver)] = trial.resolver, (v_plus, 0)
    name = "kinetic_energy" if case.unequal is None else "unequal_kinetic_energy"
    if name in trial.laws:
        trial.verdicts[name].try_on(trial.laws[name], own, trial.resolver, trial.bounds)


def _drawn(trial: _Trial) -> Iterator[tuple[int, ImpactCase, ImpactCase]]:
    """Yield (number, impact, variant with unequal restitutions): the contract's fixed impacts have
    number 0, the random ones count from 1. Without a law of unequal restitution the variant is the
    impact itself.
    """
    unequal = any(name in UNEQUAL_LAWS for name in trial.laws)
    seed = trial.seed
    rng, other, adverse = (np.random.default_rng(own) for own in (seed, [seed, 1], [seed, 2]))
    for case in trial.contract.first(adverse):
        yield 0, case, with_unequal_restitution(adverse, case) if unequal else case
    for number in range(trial.impacts):
        case = trial.contract.draw(rng, number, trial.largest_condition)
        yield number + 1, case, with_unequal_restitution(other, case) if unequal else case


class _Hunts(NamedTuple):
    """What the searches for counterexamples share."""

    trial: _Trial
    resolver: Resolver
    child: Child | None
    search: int
    contract: str
    ends: float
    progress: Callable[[int, int], None] | None


def _counterexamples(hunts: _Hunts) -> Iterator[Counterexample]:
    """Yield a counterexample to the first law that an answer broke, and one to the first law for
    which the resolver gave no usable answer."""
    verdicts = hunts.trial.verdicts.values()
    for broken in verdicts:
        if broken.smallest_case is not None and broken.largest_case is not None:
            drawn = broken.smallest_case, broken.largest_case
            yield _counterexample(broken, drawn, "", hunts)
            break
    for broken in verdicts:
        if broken.fault_case is not None:
            yield _counterexample(broken, (broken.fault_case,), broken.fault, hunts)
            break


def _counterexample(
    broken: LawVerdict, drawn: tuple[ImpactCase, ...], fault: str, hunts: _Hunts
) -> Counterexample:
    """Return the smallest counterexample that hypothesis or the drawn impacts give, shrunk."""
    if kind_of(fault) == HANGS:
        return Counterexample(drawn[0], broken.law, fault)
    began = time.monotonic()
    seconds = min(SHRINKING, max(LITTLE_TIME, hunts.ends - began))

    def tell() -> None:
        if hunts.progress is not None:
            spent = min(time.monotonic() - began, seconds)
            hunts.progress(int(spent), int(seconds))

    given = hunts.trial.laws[broken.law], fault, hunts.trial.bounds, hunts.resolver, hunts.child
    hunt = Hunt(*given, seconds, tell)
    kind = "unequal" if broken.law in UNEQUAL_LAWS else hunts.contract

    def search(fails: Callable[[ImpactCase], bool]) -> ImpactCase | None:
        from verification.laws.strategies import search_counterexample  # brings hypothesis

        examples = hunts.search
        seed = hunts.trial.seed
        return search_counterexample(fails, examples, seed, kind) if examples else None

    case = hunt.smallest(drawn, search)
    earlier = tuple[bytes, ...]()
    later = None if case else hunt.after_calls(*broken.first_calls[bool(fault)])
    if later is not None:
        case, earlier = later
    fresh = None
    if hunts.child is not None and (case is not None or time.monotonic() < hunt.ends):
        fresh = case is not None
    case = drawn[0] if case is None else case
    calls = hunt.calls_for(case, earlier)
    return Counterexample(case, broken.law, fault, calls, earlier, fresh)
