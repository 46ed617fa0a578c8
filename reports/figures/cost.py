"""Error of whole motions against their computing time."""

from __future__ import annotations

from reports.figures.figure import Drawn, Panel, recipe
from reports.figures.plot import Plot, note
from reports.figures.style import MUTED, STYLES
from verification.cost import trajectories as motion
from verification.cost.steps import IDEAL
from verification.table import Table

_NAMES = {
    "IAPB": "IAPB",
    motion.STIFF_IAPB: "IAPB, stiff springs",
    motion.STIFF_PB: "stiff springs only",
    IDEAL: "rigid wall, from Python",
    motion.MUJOCO: "MuJoCo, from Python",
}
_REAL_TIME = 1e3  # [ms per simulated second]
_ERRORS = (1e-5, 10.0)  # [lengths of the body]


@recipe("motions", "haptic-rate/motions")
def motions(table: Table) -> Drawn:
    """Draw a panel for each scene, all with the same axes, and a curve for each world."""
    tried = table["method"]
    names = {world: name for world, name in _NAMES.items() if world in tried}
    spent = [run["time"] for run in motion.runs_of(table)]
    ends = min(spent) / 2.0, max(*spent, _REAL_TIME) * 2.0
    panels = []
    for number, scene in enumerate(dict.fromkeys(table["scene"])):
        with Plot(f"motions-{number}") as plot:
            plot.axes.axvline(_REAL_TIME, color=MUTED, linewidth=1.0, linestyle=(0, (1.4, 1.4)))
            for world, name in names.items():
                runs = motion.runs_of(table, scene=scene, method=world)
                plot.curve([(run["time"], run["position"]) for run in runs], STYLES[name])
            plot.log(
                "computing time [ms per simulated second]",
                "error [lengths of the body]",
                xlim=ends,
                ylim=_ERRORS,
            )
            note(plot.axes, (_REAL_TIME, 4.0), "real time", (-3, 0), ha="right", fontsize=8)
        least = min(motion.runs_of(table, scene=scene), key=lambda run: float(run["position"]))
        told = f"{scene}: error against time; the smallest is {least['position']:.1g}, by {least['method']}."
        panels.append(Panel(plot.svg, told, scene))
    return Drawn(panels, table, {name: STYLES[name] for name in names.values()})
