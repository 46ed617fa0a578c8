"""Counterexamples: find one that a fresh resolver fails, shrink it, and write it as a test."""

from __future__ import annotations

import pickle
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any, TypeVar

import numpy as np

from reference.exact import independent_rows
from verification.impacts import Floats, ImpactCase
from verification.laws.bounds import FACTORED, KIT, ONE_SIDED, Bounds, Law, LawResidual
from verification.laws.child import Child
from verification.laws.contracts import CONTRACTS, EXACT_LAWS
from verification.laws.resolver import Resolver, ResolverFault, answer_of

# the search prefers counterexamples with a residual above this, which rounding cannot explain
NOTABLE = 1e-6
HANGS = "gave no"  # kind of the fault of a call that takes too long
Shrinks = TypeVar("Shrinks")
_DIGITS = (0, 1, 2, 4, 8)
_ROUNDED = ("velocity", "contact_jacobian", "tangents", "mass_matrix", "friction", "unequal")


Call = tuple[tuple[Any, ...], Floats | str]  # arguments, and v⁺ or fault


@dataclass(frozen=True, eq=False)
class Counterexample:
    """An impact that breaks a law.

    Attributes
    ----------
    case, law : the impact, and the name of the law.
    fault : why the resolver's answer is unusable; "" if the answer breaks the law.
    calls : arguments, and v⁺ or fault, of each call that the law makes for this impact.
    earlier : pickled arguments of calls before these; without them a fresh resolver keeps the law.
    fresh : whether a fresh resolver was seen to break the law; None if there was none, or no time.
    """

    case: ImpactCase
    law: str
    fault: str = ""
    calls: tuple[Call, ...] = ()
    earlier: tuple[bytes, ...] = ()
    fresh: bool | None = None

    @property
    def title(self) -> str:
        """What the counterexample shows."""
        title = f"counterexample to {self.law}"
        if self.earlier:
            return f"{title}, which depends on earlier calls ({len(self.earlier)} in the test)"
        if self.fresh is False:
            return f"{title}, which depends on earlier calls: a fresh resolver keeps the law here"
        if self.fresh is None and self.calls:
            return f"{title} (no fresh resolver was tried)"
        if self.law.endswith("repeatability"):
            return f"{title}: v⁺ depends on earlier calls"
        return title


def residual_of(law: Law, case: Any, resolver: Any, bounds: Any) -> tuple[LawResidual | None, str]:
    """Return the law's residual and ""; if the answer is unusable, an infinite residual and the
    resolver's fault."""
    try:
        return law.check(case, resolver, bounds), ""
    except ResolverFault as fault:
        return LawResidual("", np.inf, 0.0), str(fault)


def kind_of(fault: str) -> str:
    """Return the kind of a fault: its first two words, such as "raised ValueError:"."""
    return " ".join(fault.split()[:2])


@dataclass
class Hunt:
    """The search for an impact that breaks a law, by the same kind of fault as the impact drawn.

    kind : of the fault, see `kind_of`; "" if an answer breaks the law.
    child : makes fresh resolvers, and makes the calls; None if the resolver itself is called.
    ends : when the time is over; half of it is kept for fresh resolvers.
    tell : called at each try.
    """

    law: Law
    kind: str
    bounds: Bounds
    resolver: Resolver
    child: Child | None
    ends: float
    tell: Callable[[], None]

    def __post_init__(self) -> None:
        if self.child is not None:
            self.resolver = self.child
            self.half = 0.5 * (time.monotonic() + self.ends)
        else:
            self.half = self.ends

    def breaks(
        self, case: ImpactCase, least: float = 0.0, earlier: Sequence[bytes] | None = None
    ) -> bool:
        """Whether the impact breaks the law with a residual of `least` or more; if `earlier` calls
        are given, by a fresh resolver after these calls."""
        self.tell()
        left = (self.ends if earlier is not None else self.half) - time.monotonic()
        if left <= 0.0 or (earlier is not None and not self.replays(earlier)):
            return False
        residual, fault = residual_of(self.law, replace(case), self.resolver, self.bounds)
        if residual is None or residual.passed or kind_of(fault) != self.kind:
            return False
        return bool(fault) or not residual.value < least

    def replays(self, earlier: Sequence[bytes]) -> bool:
        """Make the calls with a fresh resolver; whether it answers all of them."""
        if self.child is None:
            return False
        self.child.restart()
        answers = (answer_of(self.child, pickle.loads(call)) for call in earlier)
        return not any(isinstance(answer, ResolverFault) for answer in answers)

    def smallest(
        self,
        drawn: Sequence[ImpactCase],
        search: Callable[[Callable[[ImpactCase], bool]], ImpactCase | None],
    ) -> ImpactCase | None:
        """Return a small impact that a fresh resolver fails; None if there is none without earlier
        calls."""
        for least in (NOTABLE, 0.0):
            fails = partial(self.breaks, least=least)
            found = search(fails)
            failing = [case for case in (found, *drawn) if case is not None and fails(case)]
            if not failing:
                continue
            smallest = shrink(min(failing, key=_size), fails, smaller_impacts)
            if self.child is None or self.breaks(smallest, least, ()):
                return smallest
            break
        fails = partial(self.breaks, earlier=())
        fresh = next((case for case in drawn if fails(case)), None)
        return None if fresh is None else shrink(fresh, fails, smaller_impacts)

    def after_calls(
        self, case: ImpactCase, calls: Sequence[bytes]
    ) -> tuple[ImpactCase, tuple[bytes, ...]] | None:
        """Return an impact that a fresh resolver fails after some of these calls, and those; None if
        it keeps the law after all of them."""
        own = pickle.dumps(case.given())
        every = list(calls)
        before = every[: len(every) - 1 - every[::-1].index(own)] if own in every else every
        earlier = next((some for some in (before, every) if self.breaks(case, earlier=some)), None)
        if earlier is None:
            return None
        size = len(earlier) // 2
        while size:
            first = 0
            while first < len(earlier):
                fewer = earlier[:first] + earlier[first + size :]
                if self.breaks(case, earlier=fewer):
                    earlier = fewer
                else:
                    first += size
            size //= 2
        for count in (1, len(earlier)):  # the same call again and again says it best
            if self.repeats(count, case):
                again = shrink(case, partial(self.repeats, count), smaller_impacts)
                return again, tuple(_again(again, count))
        fails = partial(self.breaks, earlier=earlier)
        return shrink(case, fails, smaller_impacts), tuple(earlier)

    def repeats(self, count: int, case: ImpactCase) -> bool:
        """Whether a fresh resolver breaks the law after the impact's own call, `count` times."""
        return self.breaks(case, earlier=_again(case, count))

    def calls_for(self, case: ImpactCase, earlier: Sequence[bytes]) -> tuple[Call, ...]:
        """Return the calls that the law makes for the impact, each with its answer or fault."""
        calls: list[Call] = []

        def recorded(*given: Any) -> Floats:
            kept = pickle.loads(pickle.dumps(given))
            answer = answer_of(self.resolver, given)
            if isinstance(answer, ResolverFault):
                calls.append((kept, str(answer)))
                raise answer
            calls.append((kept, answer))
            return answer

        self.replays(earlier)
        residual_of(self.law, replace(case), recorded, self.bounds)
        return tuple(calls)


def _again(case: ImpactCase, count: int) -> list[bytes]:
    return [pickle.dumps(case.given())] * count


def _size(case: ImpactCase) -> int:
    return case.coordinates + case.contacts


def shrink(
    case: Shrinks,
    fails: Callable[[Shrinks], bool],
    smaller_of: Callable[[Shrinks], Iterator[Shrinks]],
) -> Shrinks:
    """Return a smaller case that still fails, greedily; the case itself if nothing smaller does.

    The search ends, because each step removes the translations, a row, a coordinate, a restitution
    other than 1, or digits. The result depends only on the answers of `fails`.
    """
    while True:
        smaller = next(filter(fails, smaller_of(case)), None)
        if smaller is None:
            return case
        case = smaller


def smaller_impacts(case: ImpactCase) -> Iterator[ImpactCase]:
    """Yield simpler impacts with a positive definite M, and independent normal and tangents."""
    return filter(_is_valid, _smaller(case))


def _smaller(case: ImpactCase) -> Iterator[ImpactCase]:
    if case.translations is not None:
        yield replace(case, translations=None)
    for i in range(case.contacts):
        yield _without(case, ("contact_jacobian", "tangents", "friction", "unequal"), i, 0)
    if case.coordinates > 1 and case.translations is None:
        for k in range(case.coordinates):
            fewer = _without(
                case, ("velocity", "contact_jacobian", "tangents", "mass_matrix"), k, -1
            )
            yield _without(fewer, ("mass_matrix",), k, 0)
    for e in (1.0, 0.0):
        if case.unequal is None and case.restitution not in (1.0, e):
            yield replace(case, restitution=e)
    for digits in _DIGITS:
        for name in _ROUNDED:
            yield from rounded(case, name, digits)


def _without(case: ImpactCase, names: tuple[str, ...], index: int, axis: int) -> ImpactCase:
    """The case without this entry of the named arrays along an axis."""
    arrays = {name: getattr(case, name) for name in names}
    return replace(
        case,
        **{
            name: np.delete(array, index, axis)
            for name, array in arrays.items()
            if array is not None
        },
    )


def rounded(case: Any, name: str, digits: int) -> Iterator[Any]:
    """Yield the case with the array rounded to `digits` decimals, if that makes the array's text
    shorter."""
    array = getattr(case, name)
    if array is None:
        return
    rounder = np.round(array, digits) + 0.0  # no −0.0
    if text_length(rounder) < text_length(array):
        yield replace(case, **{name: rounder})


def text_length(array: np.ndarray) -> int:
    """Length of the array as text; each rounding must reduce it, so that shrinking ends."""
    return sum(len(repr(float(x))) for x in array.ravel())


def _is_valid(case: ImpactCase) -> bool:
    """Whether M is positive definite up to rounding, by elimination in a fixed order and without
    BLAS."""
    rest = case.mass_matrix
    least = 1e-14 * np.diag(rest).max()
    while len(rest):
        if not rest[0, 0] > least:
            return False
        rest = rest[1:, 1:] - np.outer(rest[1:, 0] / rest[0, 0], rest[0, 1:])
    return tangents_are_independent(case)


# A counterexample as the source code of a test, to paste next to the resolver.

_TEST = """\
import numpy as np
from verification.laws import {table}, ImpactCase
from verification.laws.bounds import {imported}
{importing}


def test_{law}():
{body}
    case = ImpactCase(mass_matrix, contact_jacobian, velocity, {restitution!r}{more})
    residual = {table}[{law!r}].check(case, {called}, {bounds})
    assert residual.passed, residual"""
_ALWAYS = ("mass_matrix", "contact_jacobian", "velocity")
_OPTIONAL = ("translations", "tangents", "friction", "unequal")
_BY_NAME = {"KIT": KIT, "FACTORED": FACTORED, "ONE_SIDED": ONE_SIDED}


def as_test(
    case: ImpactCase,
    law: str,
    bounds: Bounds = KIT,
    resolver: Any = None,
    contract: str = "equality",
    earlier: Sequence[bytes] = (),
    limit: float = np.inf,
) -> str:
    """Return the source code of a test of `law` on the case; if the resolver cannot be imported,
    its line is a gap.

    The test makes the `earlier` calls first. A finite `limit` [s] ends a call that hangs.
    """
    given = {name: getattr(case, name) for name in (*_ALWAYS, *_OPTIONAL)}
    arrays = {name: array for name, array in given.items() if array is not None}
    table = "EXACT_LAWS" if law in EXACT_LAWS else CONTRACTS[contract].table
    name = next((name for name, known in _BY_NAME.items() if known == bounds), "")
    importing = import_line(resolver) or "\n# resolver = ...  the one under test"
    called = "resolver"
    if limit < np.inf:
        importing = f"from verification.laws.child import Child\n{importing}"
        called = f"Child(resolver, {limit!r})"
    body = [
        *_repeating(earlier),
        *(f"    {key} = {written(array)}" for key, array in arrays.items()),
    ]
    return _TEST.format(
        table="UNEQUAL_LAWS" if law.startswith("unequal_") else table,
        imported=name or "Bounds",
        importing=importing,
        law=law,
        body="\n".join(body),
        restitution=case.restitution,
        more="".join(f", {name}={name}" for name in _OPTIONAL if name in arrays),
        called=called,
        bounds=name or repr(bounds).replace("=inf", "=np.inf"),
    )


def _repeating(earlier: Sequence[bytes]) -> Iterator[str]:
    """Yield lines that make the earlier calls, each followed by itself in a loop."""
    if earlier:
        yield "    # the failure depends on these calls before it"
    for pickled, same in groupby(earlier):
        count = len(list(same))
        indent = "    "
        if count > 1:
            yield f"    for _ in range({count}):"
            indent = 2 * indent
        yield f"{indent}resolver("
        for value in pickle.loads(pickled):
            text = written(value) if isinstance(value, np.ndarray) else repr(value)
            yield f"{indent}    {text},"
        yield f"{indent})"


def import_line(resolver: Any) -> str:
    """Return the lines that import `resolver`; empty for a lambda or another object that cannot be
    imported."""
    inner = resolver.func if isinstance(resolver, partial) and not resolver.args else resolver
    module = getattr(inner, "__module__", None)
    if not isinstance(module, str) or module == "__main__":
        return ""
    there = vars(sys.modules[module]) if module in sys.modules else {}
    name = next((name for name, value in there.items() if value is inner), "")
    if not name:
        return ""
    if inner is resolver:
        return f"from {module} import {name} as resolver"
    options = name_of(resolver, "partial")
    return f"from {module} import {name}\nfrom functools import partial\n\nresolver = {options}"


def name_of(resolver: Any, word: str = "") -> str:
    """Return the name of a resolver with the options of a partial; `word` writes it as a call of
    that function."""
    if isinstance(resolver, partial) and not resolver.args:
        options = ", ".join(f"{key}={value!r}" for key, value in resolver.keywords.items())
        name = getattr(resolver.func, "__name__", repr(resolver.func))
        return f"{word}({name}, {options})" if word else f"{name}({options})"
    kind = type(resolver)
    plain = kind.__qualname__ if kind.__repr__ is object.__repr__ else repr(resolver)
    return getattr(resolver, "__qualname__", None) or plain


def written(array: np.ndarray) -> str:
    """The array as source code; an empty array also needs its shape."""
    text = f"np.array({array.tolist()!r}, dtype=float)"
    return text if array.size else f"{text}.reshape({array.shape})"


def tangents_are_independent(case: ImpactCase) -> bool:
    """Whether the normal and the tangents of each contact are linearly independent; True without
    friction."""
    if case.tangents is None:
        return True
    blocks = np.concatenate([case.contact_jacobian[:, None], case.tangents], axis=1)
    return all(len(independent_rows(block)) == len(block) for block in blocks)
