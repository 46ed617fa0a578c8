"""Messages for unknown names, with the most similar known name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


def nearest(wrong: Any, known: Iterable[Any]) -> str:
    """Return the known name most similar to `wrong`, ignoring case; empty if none is similar."""
    spelt = {str(name).casefold(): str(name) for name in known}
    near = difflib.get_close_matches(str(wrong).casefold(), spelt, n=1)
    return spelt[near[0]] if near else ""


def one_of(wrong: Any, known: Iterable[Any], lead: str = "one of ") -> str:
    """Say what was expected instead of `wrong`: ``one of peg_corner, two_discs; did you mean
    peg_corner?``."""
    names = [str(name) for name in known]
    near = nearest(wrong, names)
    return lead + ", ".join(names) + (f"; did you mean {near}?" if near else "")


def in_metres(length: float) -> str:
    """Return a length [m] as text, in millimetres below 1 m."""
    return f"{length:.3g} m" if length >= 1.0 else f"{1e3 * length:.3g} mm"
