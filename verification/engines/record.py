"""EngineRecord: the results of one engine on one scene at one choice of settings."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EngineRecord:
    """Results of one run. A number is None if it does not apply or if there is no trajectory.

    engine, title, version : name of the adapter, name of the engine, and its version ("" if it is not installed)
    scene : name of the scene; rests : whether all bodies must stay at rest in this scene
    choice : "own" or "matched"; settings : step and options in words; note : features that the engine lacks
    duration : simulated time [s]
    energy_error : (kinetic energy at the end − true) / kinetic energy at the start; impact scenes
    energy_gain : largest rise of kinetic plus potential energy above its start value, divided by the kinetic energy at
    the start; in resting scenes divided by the work of gravity along the scene's length
    momentum_error : |momentum at the end − true| / sum of m |v| at the start; impact scenes
    velocity_error : largest error of a body's final velocity / largest speed at the start; impact scenes
    penetration : deepest overlap [m], by our measure; most_contacts : largest number of contacts, as the engine counts
    drift : largest distance of a body from its start [m]; creep : drift in the second half; resting scenes
    failure : reason why there are no numbers; missing : how to install the engine
    """

    engine: str
    title: str
    version: str
    scene: str
    rests: bool
    choice: str
    settings: str = ""
    note: str = ""
    step: float | None = None
    duration: float = 0.0
    energy_error: float | None = None
    energy_gain: float | None = None
    momentum_error: float | None = None
    velocity_error: float | None = None
    penetration: float | None = None
    most_contacts: int | None = None
    drift: float | None = None
    creep: float | None = None
    failure: str = ""
    missing: str = ""
