"""Answer: what a solver's file hands back; the Solution judges it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Answer:
    """Impulse (n,) [N s] or None, with what the solver said; `seconds` where it keeps its own time."""

    impulse: NDArray[np.float64] | None
    note: str = ""
    refused: bool = False
    seconds: float | None = None
