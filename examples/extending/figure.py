"""A figure: the kinetic energy of the peg in the corner falls at each impact.

In the project it is a file of reports/figures, named in its __init__.py, with title and caption in
figures.toml. A recipe names the runs and tables that it needs.

Prints:
    What an impact takes: 1 panel
"""

from iapb import Run, find_scene, simulate
from reports.figures.figure import TEXTS, Drawn, Panel, draw, recipe
from reports.figures.plot import Plot
from reports.figures.style import STYLES

TEXTS["peg-energy"] = {
    "title": "What an impact takes",
    "caption": "Kinetic energy of the peg. Each fall is an impact; no impact adds any.",
}


@recipe("peg-energy", "corner/IAPB")
def peg_energy(run: Run) -> Drawn:
    """Draw the figure from the run."""
    energy = 1e3 * run.energy["kinetic"]
    with Plot("peg-energy") as plot:
        plot.curve(zip(run.time, energy, strict=True), STYLES["IAPB"], marked=False)
        plot.axes.set(xlabel="time [s]", ylabel="kinetic energy [mJ]")
    alt = f"The kinetic energy rises and falls; {len(run.impacts.step)} falls are impacts."
    return Drawn((Panel(plot.svg, alt),), legend=(("IAPB", STYLES["IAPB"]),))


figure = draw(peg_energy, {"corner/IAPB": simulate(find_scene("peg_corner"))})
print(f"{figure.title}: {len(figure.panels)} panel")
