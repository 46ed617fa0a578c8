"""Your own scene in several worlds: distance from the ideal world, time per step and energy of
each.

Run it: python examples/compare_worlds.py   (on the command line: iapb compare slope.yaml)
"""

from pathlib import Path

from verification import compare_worlds

Path("slope.yaml").write_text("""\
name: slope
rate: 1000
duration: 0.3
gravity: [3.355, -9.218]        # a floor tilted by 20 degrees
bodies:
  - {name: box, joint: planar, mass: 1.0, inertia: 0.002, position: [0, 0.05, 0],
     shapes: [{kind: box, size: [0.1, 0.1]}]}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}
contact: {stiffness: 10000, damping: 100, friction: 0.5, restitution: 0}
""")

finding = compare_worlds("slope.yaml", worlds=["IAPB", "PB", "ideal-friction"])
print(finding.answer)
for row in finding.tables["worlds"].records():
    print({name: row[name] for name in list(row)[:4]})
