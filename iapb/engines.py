"""Other engines as worlds: what an engine offers, and the run of its states.

An engine simulates a scene by its own method. It returns a `Run` of configurations and velocities;
energies follow from them, in the same way for all engines. What a run of an engine lacks, such as
contacts and their forces, has no rows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from iapb.mechanics.mechanism import Mechanism
from iapb.numerics.schema import Floats, blank, quantities, zeros_of
from iapb.run import ContactTable, EffectRow, ImpactTable, Run
from iapb.scene.mechanism import gravity_of, hand_force_of, mechanism_of
from iapb.scene.model import Scene, SpatialScene

Progress = Callable[[int, int], None]

# Arrays of a run that an engine's run does not have.
ABSENT = (
    "device_q",
    "device_v",
    "device_force",
    "state",
    "hand_force",
    "coupling_force",
    "penalty_force",
    "friction_force",
    "impulse",
    "environment_force",
)


class Engine(Protocol):
    """An engine that simulates scenes."""

    @property
    def name(self) -> str:
        """Name of the engine, recorded as the law of its runs."""
        ...

    @property
    def settings(self) -> dict[str, Any]:
        """Settings and version of the engine: plain numbers and texts, recorded in its runs and
        part of their keys."""
        ...

    def ignored(self, scene: Scene) -> tuple[str, ...]:
        """Return the fields of the scene that the engine ignores; a run that ignores one is not
        scored."""
        ...

    def run(self, scene: Scene, steps: int | None = None, progress: Progress | None = None) -> Run:
        """Simulate a scene, by default for its duration, and return the run (see
        `run_of_states`)."""
        ...


def is_engine(law: Any) -> TypeGuard[Engine]:
    """Whether this is an engine; a contact law advances single steps and has no `run`."""
    return not isinstance(law, type) and all(
        hasattr(law, name) for name in ("name", "settings", "ignored", "run")
    )


def fields_of_our_engine(scene: Scene) -> tuple[str, ...]:
    """Return the fields of a scene that other engines have nothing like: device, coupling, our own
    contact forces.

    A device counts where a hand holds the tool through it, contact forces where something can
    touch.
    """
    found = ["couplings", *["device"] * (scene.device is not None)] if scene.is_coupled else []
    if any(body.shapes for body in scene.bodies):
        found += ["contact.forces"] * (scene.contact.forces == "paper")
        per_body = scene.contact.self_collision_rows == "per_body"
        found += ["contact.self_collision_rows"] * per_body
        found += [
            f"contact.{name}"
            for name in ("stiffness", "damping")
            if scene.contact.forces != "paper" and not scene.contact.rigid
        ]
    return tuple(found)


def run_of_states(
    scene: Scene,
    engine: Engine,
    q: ArrayLike,
    v: ArrayLike,
    *,
    stopped: str = "",
    seconds: float = 0.0,
) -> Run:
    """Return the run of an engine's states.

    Parameters
    ----------
    scene : Scene
    engine : Engine
    q : (n + 1, nq) configurations at the start and at the end of each step, with the coordinates of
        `mechanism_of`
    v : (n + 1, d) velocities at the same instants; those of a free flyer are in body axes
    stopped : why the run ended early; empty if it did not
    seconds : time that the steps took [s]
    """
    mechanism = mechanism_of(scene)
    places = np.ascontiguousarray(q, np.float64)
    rates = np.ascontiguousarray(v, np.float64)
    steps = len(places) - 1
    kinetic, potential = mechanism.energies(places, rates, gravity_of(scene))
    work = _work_of_the_hand(scene, mechanism, places)
    lengths = {
        "time": steps + 1,
        "step": 0,
        "velocity": mechanism.nv,
        "device_coordinate": 0,
        "device_velocity": 0,
    }
    absent: dict[str, Any] = blank(
        (each for each in quantities(Run) if each.name in ABSENT), lengths
    )
    reason = f"{engine.name} has nothing like it"
    return Run(
        scene_name=scene.name,
        scene_source=scene.source_text,
        scene_resolved=scene.resolved(),
        world=engine.name,
        law=engine.name,
        law_settings=dict(engine.settings),
        coupling="none",
        coupling_settings={},
        dt=scene.step,
        complete=not stopped,
        stopped=stopped,
        coordinate_names=mechanism.coordinate_names,
        coordinate_units=mechanism.coordinate_units,
        velocity_names=mechanism.velocity_names,
        velocity_units=mechanism.velocity_units,
        body_names=mechanism.names,
        tool_dofs=(0, 0),
        tool_coordinates=(0, 0),
        time=scene.step * np.arange(steps + 1, dtype=np.float64),
        q=places,
        v=rates,
        pose=mechanism.poses(places, planar=not isinstance(scene, SpatialScene)),
        contacts=zeros_of(ContactTable, contact=0, axis=3, step_edge=steps + 1),
        impacts=zeros_of(ImpactTable, impact=0, velocity=mechanism.nv, coordinate=mechanism.nq),
        energy={"kinetic": kinetic, "potential": potential, "hand_work": work},
        effects=tuple(EffectRow(field, False, reason, field) for field in engine.ignored(scene)),
        chunk_steps=np.array([steps], np.int64),
        chunk_seconds=np.array([seconds]),
        kernel="python",
        **absent,
    )


def _work_of_the_hand(scene: Scene, mechanism: Mechanism, q: Floats) -> Floats:
    """Return the work (n,) [J] of the hand's force up to the end of each step: the sum of F ·
    Δq."""
    middles = (np.arange(len(q) - 1) + 0.5) * scene.step
    forces = np.zeros((len(middles), mechanism.nv))
    for k, time in enumerate(middles.tolist() if scene.hand is not None else ()):
        forces[k] = hand_force_of(scene, mechanism, q[k], time)
    return np.cumsum(np.einsum("nd,nd->n", forces, mechanism.displacements(q)))
