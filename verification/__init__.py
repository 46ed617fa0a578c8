"""Evidence: proofs, physical laws, hard cases, accuracy against time, claims. Studies return
records, not files.

Each name below is loaded at its first use, so ``import verification`` is fast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iapb.lazy import lazy_names

if TYPE_CHECKING:
    from verification.cost.accuracy import which_method as which_method
    from verification.cost.accuracy import work_precision as work_precision
    from verification.laws import check_passivity as check_passivity
    from verification.worlds import compare_worlds as compare_worlds

_HOME = {
    "check_passivity": "verification.laws",
    "which_method": "verification.cost.accuracy",
    "work_precision": "verification.cost.accuracy",
    "compare_worlds": "verification.worlds",
}

__getattr__, __dir__, __all__ = lazy_names(__name__, _HOME)
