"""EngineRecord: one engine on one scene at one choice of settings; plain numbers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EngineRecord:
    """What came out. Every number is None where it does not apply, or where there is no trajectory.

    engine, title, version : name of the adapter, of the engine, and its version ("" where it is not installed)
    scene, rests : name of the scene; whether its law is to stay at rest
    choice : "own" or "matched"; settings : step and options in words; note : what the engine cannot do
    duration : simulated time [s]
    energy_error : (kinetic energy at the end − true) / kinetic energy at the start; impact scenes
    energy_gain : largest rise of kinetic and potential energy above the start's, over the kinetic energy at the start;
    at rest, over the work of gravity along the scene's length
    momentum_error : |momentum at the end − true| / sum of m |v| at the start; impact scenes
    velocity_error : largest error of a body's final velocity / largest speed at the start; impact scenes
    penetration : deepest overlap [m], by our measure; most_contacts : of one instant, as the engine counts
    drift : farthest that a body went from its start [m]; creep : the same in the second half; resting scenes
    failure : why there are no numbers; missing : how to install the engine
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
