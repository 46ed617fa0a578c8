"""What a study finds. A case that raises costs its own row: `attempt` records it as a Failure and the study goes on."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")


@dataclass(frozen=True)
class Failure:
    """A case that could not be computed.

    case : the case, as its row is named
    error : type of the exception; reason : first line of its message
    traceback : where it was raised
    """

    case: str
    error: str
    reason: str
    traceback: str = ""


def failure_of(case: str, error: Exception) -> Failure:
    """Return the record of an exception."""
    reason = (str(error).splitlines() or ["no reason given"])[0]
    return Failure(case, type(error).__name__, reason, "".join(traceback.format_exception(error)))


def attempt(case: str, compute: Callable[[], Result], failures: list[Failure]) -> Result | None:
    """Return compute(), or append a Failure and return None where it raises an Exception.

    An interrupt (KeyboardInterrupt, SystemExit) is no failure of the case and passes through.
    """
    try:
        return compute()
    except Exception as error:
        failures.append(failure_of(case, error))
        return None
