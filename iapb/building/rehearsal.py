"""A rehearsal of the engine before its library is compiled: which kernels Python calls, and how.

Everything that Python asks of the engine happens once here, in a scene as small as possible, with
kernels that run as Python. The outermost kernels are what the library must have.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from iapb.contact.impact import resolve_impact
from iapb.contact.kernels.impact import ImpactWork, factored_impacts
from iapb.contact.kernels.passive import gain_signs
from iapb.haptics.coupling import UnilateralCoupler
from iapb.haptics.device import SimulatedDevice
from iapb.haptics.rendering import read_device
from iapb.mechanics.mechanism import Mechanism
from iapb.mechanics.rotations import angles_of
from iapb.numerics.compiled import Entry, Kernel, block, kinds_of
from iapb.numerics.linalg import product
from iapb.numerics.schema import zeros_of
from iapb.scene import scene_from_text
from iapb.simulation import Simulation, simulate

BALL_ON_FLOOR = """
name: rehearsal
rate: 1000
duration: 0.001
bodies:
  - name: ball
    joint: planar
    mass: 1.0
    inertia: 1.0
    position: [0, 0.99, 0]
    velocity: [0, -1, 0]
    shapes: [{kind: circle, radius: 1.0}]
walls: [{name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}]
contact: {restitution: 0.5, friction: 0.1}
hand: {body: ball, force: [0, -1, 0]}
"""
GAINS = UnilateralCoupler((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
Call = tuple[Kernel, tuple[Any, ...]]


def rehearsed() -> list[Call]:
    """Return the kernels that Python calls, each with examples of its arguments."""
    calls: dict[str, Call] = {}
    running: list[Kernel] = []

    def find(kernel: Kernel, kinds: str) -> Callable[..., Any]:
        """Return the Python function; note its call if no other kernel is running."""

        def run(*arguments: Any) -> Any:
            if not running:
                calls.setdefault(f"{kernel.name}({kinds_of(arguments)})", (kernel, arguments))
            running.append(kernel)
            try:
                return kernel.function(*arguments)
            finally:
                running.pop()

        return run

    library_finds = Kernel.find
    Kernel.find = find  # type: ignore[method-assign, assignment]
    try:
        _perform()
    finally:
        Kernel.find = library_finds  # type: ignore[method-assign]
    return list(calls.values())


def _perform() -> None:
    """Ask everything of the engine that Python asks of it."""
    scene = scene_from_text(BALL_ON_FLOOR)
    _ = simulate(scene).energy
    device = SimulatedDevice(np.eye(3), np.zeros(3), dt=0.001)
    simulation = Simulation(scene, coupling=GAINS, device=device)
    simulation.step()
    simulation.system.contacts_at(simulation.state.q)
    held = Simulation(scene, coupling=GAINS)
    held.follow(np.zeros((2, 3)), np.zeros((2, 3)))
    Entry(read_device)(held.world, held.state, held.port, np.zeros(3), np.zeros(3))
    _impacts()
    _mechanics(simulation.system.mechanism)


def _impacts() -> None:
    v = np.array([-1.0, -1.0])
    resolve_impact(np.eye(2), np.eye(2), v, 0.5)
    gain_signs(np.eye(2)[None], v[None], -v[None], np.empty(1, np.int64))
    work = block(zeros_of(ImpactWork, velocity=2, row=2))
    many = np.eye(2)[None], np.eye(2)[None], v[None], np.ones(1)
    factored_impacts(*many, 2, True, 1, work, np.empty((1, 2)), np.empty(1))


def _mechanics(body: Mechanism) -> None:
    """Ask for every quantity of a mechanism."""
    q = body.neutral()
    v = np.ones(body.nv)
    g = np.ones(3)
    body.difference(q, body.integrate(q, v))
    body.poses(q[None], planar=True)
    body.mass_matrix(q)
    body.mass_matrices(q[None])
    body.bias(q, v)
    body.gravity(q, g)
    body.inverse_dynamics(q, v, v, g)
    body.point_jacobian(q, 0, g)
    body.frame_jacobian(q, 0)
    body.rows_along(q[None], [0], g[None], g[None])
    body.kinetic_energy(q, v)
    body.displacements(np.stack([q, q]))
    body.centroidal_momentum(q, v)
    product(np.eye(2), np.eye(2))
    angles_of(np.eye(3))
