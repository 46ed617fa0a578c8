"""Small scenes in space that have an event-driven truth: dropped bodies, a cradle of spheres, a swinging arm.

They stand here, not among the project's scenes, because they show nothing but convergence.
"""

from __future__ import annotations

_DROPPED = """
name: %s
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: body, joint: free_flyer, mass: 0.5, inertia: [2e-4, 3e-4, 4e-4], shapes: [%s],
     position: [0, 0, 0.2, 0, 0, 0, 1], velocity: [0.3, -0.2, 0, %s]}
walls: [{name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0.1, 1]}]
contact: {restitution: %g, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""
_BALL, _BOX = "{kind: sphere, radius: 0.04, center: [0.01, 0, 0]}", "{kind: box, size: [0.06, 0.08, 0.03]}"

_SPHERE = (
    "  - {name: ball_%d, joint: free_flyer, mass: %g, inertia: [1e-4, 1e-4, 1e-4], "
    "shapes: [{kind: sphere, radius: 0.02}],\n     position: [%g, 0, 0, 0, 0, 0, 1], velocity: [%g, 0, 0, 0, 0, 0]}\n"
)
_CRADLE = (
    "name: cradle_in_space\ndimensions: 3\nrate: 1000\nduration: 1\nbodies:\n"
    + "".join(_SPHERE % row for row in ((0, 0.2, 0.0, 1.0), (1, 0.4, 0.0613, 0.0), (2, 0.2, 0.1227, 0.0)))
    + "contact: {restitution: 0.7, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}\n"
)

_SWINGING_ARM = """
name: arm_meets_a_wall_in_space
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: upper, joint: spherical, mass: 1, inertia: [2e-3, 1e-2, 1e-2], center_of_mass: [0.15, 0, 0]}
  - {name: lower, parent: upper, joint: revolute, axis: [0, 1, 0], origin: [0.3, 0, 0], mass: 0.5,
     inertia: [1e-3, 4e-3, 4e-3], center_of_mass: [0.1, 0, 0], velocity: [1],
     shapes: [{kind: sphere, radius: 0.03, center: [0.25, 0, 0]}]}
walls: [{name: wall, kind: half_space, point: [0, 0, -0.2], normal: [0.2, 0, 1]}]
contact: {restitution: 0, friction: 0, stiffness: 1e4, damping: 0, friction_velocity: 1e-2}
"""

TRUTH_SCENES = {
    "ball_dropped_in_space": _DROPPED % ("ball_dropped_in_space", _BALL, "5, 3, 1", 0.6),
    "box_dropped_in_space": _DROPPED % ("box_dropped_in_space", _BOX, "3, 2, 1", 0.3),
    "box_landing_in_space": _DROPPED % ("box_landing_in_space", _BOX, "3, 2, 1", 0.0),
    "cradle_in_space": _CRADLE,
    "arm_meets_a_wall_in_space": _SWINGING_ARM,
}
