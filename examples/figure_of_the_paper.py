"""The numbers behind Figure 7: the distance of each world from the ideal world, and the figure as
a page.

Run it: python examples/figure_of_the_paper.py
"""

import numpy as np

from iapb import find_scene, load_scene
from reference.worlds import run_world
from reports.cli import main

scene = load_scene(find_scene("peg_corner"))
ideal = run_world(scene, "ideal")
for world in ("IAPB", "PB"):
    away = np.abs(run_world(scene, world).q - ideal.q).max(axis=0)
    print(
        f"{world:<5} is at most {1e3 * away[0]:.2f} mm (x) and {1e3 * away[1]:.2f} mm (y) from the ideal world"
    )
main(["reproduce", "--figure", "fig07", "--out", "figures"])  # writes figures/fig07.html
