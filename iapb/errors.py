"""Errors of the public interface. Each names the argument, its value and the expected value."""

from __future__ import annotations

import copyreg
import pickle
import re
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

_SHOWN_CHARACTERS = 120  # longer values are cut in messages
_LISTED_MISTAKES = 100  # a message lists no more; the error itself has all


def shown(value: Any) -> str:
    """Return a short one-line rendering of a value for an error message."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # too deep, or a __repr__ of a user
        text = object.__repr__(value)
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 1] + "…"


def counted(count: int, noun: str) -> str:
    """Return a count with its noun: "1 collision", "2 collisions"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


# Terminal control characters, and characters without a width or that change the direction of text;
# not tabs, line ends.
_ORDERS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]"
)


def to_stderr(line: str) -> None:
    """Write a line to stderr now, if it can be written; what would give a terminal orders is
    escaped."""
    with suppress(OSError):
        print(harmless(line), file=sys.stderr, flush=True)


def harmless(text: str) -> str:
    """Return a text in which every terminal control character is escaped."""
    return _ORDERS.sub(lambda found: ascii(found[0])[1:-1], text)


class IapbError(Exception):
    """Root of every error that iapb raises on purpose.

    Errors can be pickled with message and attributes. An attribute that cannot be pickled is
    replaced by its text.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        """Rebuild from message and attributes, because `args` lacks the arguments of a subclass's
        __init__."""
        attributes = {name: _portable(value) for name, value in vars(self).items()}
        return copyreg.__newobj__, (type(self), *self.args), attributes  # type: ignore[attr-defined]


def _portable(value: Any) -> Any:
    try:
        pickle.dumps(value)
    except Exception:  # a value's own __reduce__ may raise any exception
        return shown(value)
    return value


class ArgumentError(IapbError, ValueError):
    """An argument of a public function has an invalid value."""

    def __init__(self, argument: str, value: Any, expected: str) -> None:
        self.argument = argument
        self.value = value
        self.expected = expected
        super().__init__(f"{argument} = {shown(value)}: expected {expected}")


class RangeError(IapbError, OverflowError):
    """A result would leave the range of double precision numbers."""

    def __init__(self, quantity: str, explanation: str) -> None:
        self.quantity = quantity
        super().__init__(f"{quantity} leaves the range of double precision: {explanation}")


@dataclass(frozen=True)
class Mistake:
    """One mistake of a scene file: its place, the value found and the value expected.

    Lines and columns count from 1; they are 0 if the value was not read from the file. `path` is
    the field's path, such as ``bodies[0].mass``.
    """

    file: str
    line: int
    column: int
    path: str
    value: str
    expected: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return f"{place}: {self.path} = {self.value}: expected {self.expected}"


class SceneError(IapbError, ValueError):
    """A scene file (or study file) is invalid. The error lists *all* mistakes; `what` names the
    kind of file."""

    def __init__(self, mistakes: list[Mistake], what: str = "scene") -> None:
        self.mistakes = tuple(mistakes)
        count = len(self.mistakes)
        lines = [f"  {mistake}" for mistake in self.mistakes[:_LISTED_MISTAKES]]
        lines += [f"  and {count - len(lines)} more"] if count > len(lines) else []
        super().__init__("\n".join([f"{counted(count, 'mistake')} in the {what}:", *lines]))


class MissingDependencyError(IapbError, ImportError):
    """An optional package is not installed; the message says how to install it."""

    def __init__(self, package: str, purpose: str, install: str) -> None:
        self.package = package
        super().__init__(
            f"{purpose} needs {package}, which is not installed. Install it with: {install}"
        )


def installing(extra: str) -> str:
    """Return the command that installs an extra; no package index has iapb."""
    return f"pip install '.[{extra}]' (in a checkout of iapb)"


#: The extra that installs a package which the engine itself does not need.
EXTRAS = {
    **dict.fromkeys(
        (
            "scipy",
            "h5py",
            "threadpoolctl",
            "pinocchio",
            "cvxpy",
            "clarabel",
            "qpsolvers",
            "daqp",
            "quadprog",
            "proxsuite",
            "quantecon",
            "mujoco",
            "numba",
        ),
        "reference",
    ),
    **dict.fromkeys(
        ("hypothesis", "sympy", "flint", "typer", "rich", "xarray", "h5netcdf"), "verify"
    ),
    **dict.fromkeys(("matplotlib", "jinja2", "latex2mathml", "viser"), "report"),
}


def name_the_extra(error: ModuleNotFoundError, purpose: str) -> ImportError:
    """Return a `MissingDependencyError` that names the extra of the missing package, or the error
    itself."""
    package = (error.name or "").partition(".")[0]
    if package not in EXTRAS:
        return error
    return MissingDependencyError(package, purpose, installing(EXTRAS[package]))


class RunFileError(IapbError):
    """A file is not a readable run file of this project."""


class SolverError(IapbError):
    """A solver refused a problem or failed on it."""
