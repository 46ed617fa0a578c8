"""Studies of the mechanics: plain records, no files written. `STUDIES` has them by name, each `study(depth)`.

Timing (`robot_timing.time_robots`) stands apart: its figures belong to a machine.
"""

from __future__ import annotations

from collections.abc import Callable

from verification.mechanics.record import DEPTHS, Finding

__all__ = ["DEPTHS", "STUDIES", "Finding", "check_mechanics"]

# name: (module, function)
STUDIES = {
    "random trees": ("robots", "compare_trees"),
    "joint kinds": ("own_robots", "compare_kinds"),
    "scenes": ("own_robots", "compare_scenes"),
    "URDF texts": ("own_robots", "compare_written"),
    "robots": ("robots", "compare_robots"),
    "power balance": ("power_balance", "power_balance"),
    "positive definite": ("power_balance", "positive_definite"),
    "tumbling": ("tumbling", "tumbling"),
    "coordinate invariance": ("coordinate_invariance", "coordinate_invariance"),
    "operating": ("operating", "operating"),
}


def check_mechanics(
    depth: str = "quick", progress: Callable[[int, int], None] | None = None
) -> dict[str, Finding]:
    """Run every study and return its record by name; `progress(done, total)` after each."""
    from importlib import import_module

    findings: dict[str, Finding] = {}
    for name, (module, function) in STUDIES.items():
        study = getattr(import_module(f"{__name__}.{module}"), function)
        findings[name] = study(depth=depth)
        if progress is not None:
            progress(len(findings), len(STUDIES))
    return findings
