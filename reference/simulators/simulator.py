"""What an adapter is: an engine behind one protocol, its settings in the open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from reference.simulators.scene import FixedScene
from reference.simulators.trajectory import Trajectory


@dataclass(frozen=True)
class Settings:
    """What an engine is run with.

    step : the longest step it takes [s]; an integrator with error control may take shorter ones
    options : everything else that decides, by the engine's own names
    note : what the engine cannot do, and what stands in for it
    """

    step: float
    options: Mapping[str, str | float] = field(default_factory=dict)
    note: str = ""

    def __str__(self) -> str:
        """One line."""
        return ", ".join([f"step {1e3 * self.step:g} ms", *(f"{name} {_text(value)}"
                                                            for name, value in self.options.items())])  # fmt: skip


def _text(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


class Simulator(Protocol):
    """An engine. Adapters import theirs only in `version` and `run`."""

    title: str

    def version(self) -> str:
        """Version of the installed engine.

        Raises
        ------
        MissingDependencyError
            It is not installed; the message says how to install it.
        """
        ...

    def settings(self, scene: FixedScene, step: float | None = None) -> Settings:
        """The engine's own best settings for the scene; with `step` [s], its best at this step."""
        ...

    def run(self, scene: FixedScene, settings: Settings, step: float, duration: float) -> Trajectory:
        """Simulate the scene for a duration [s]."""
        ...
