"""One scene with many values: the deepest penetration over the stiffness, with and without
impulses.

Run it: python examples/sweep.py
"""

from pathlib import Path

from iapb import find_scene, load_scene
from reference.worlds import run_world

scene = load_scene(find_scene("peg_corner"))
print("stiffness [N/m]   IAPB [mm]   PB [mm]")
for stiffness in (500.0, 1000.0, 2000.0):
    changed = scene.with_values({"contact.stiffness": stiffness, "duration": 0.6})
    depths = [max(0.0, -run_world(changed, world).contacts.gap.min()) for world in ("IAPB", "PB")]
    print(f"{stiffness:15.0f} {1e3 * depths[0]:11.3f} {1e3 * depths[1]:9.3f}")

# The same as a study for `iapb sweep`, which stores its runs, and skips those that it has:
Path("stiffness.yaml").write_text("""\
scene: peg_corner
worlds: [IAPB, PB]
values:
  duration: [0.6]
  contact.stiffness: [500, 1000, 2000]
""")
print("Now try: iapb sweep stiffness.yaml")
