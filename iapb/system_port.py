"""The hand's side of a scene as the arrays of its kernels: hand, coupling, device, waveform."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iapb.compiled import block
from iapb.errors import ArgumentError
from iapb.haptics.coupling import Coupling, NoCoupling
from iapb.haptics.kernels import Port
from iapb.haptics.waveforms import waveform_weights
from iapb.mechanics.kernels.cholesky import cholesky
from iapb.scene import Scene

if TYPE_CHECKING:
    from iapb.system import System

Floats = NDArray[np.float64]


def make_port(system: System, coupling: Coupling, on: frozenset[str], external: bool = False) -> Port:
    """Allocate the hand's side: the device starts where the tool does, with its velocity.

    `on` are the names of the effects that are on; `external` says that the device moves by itself: it is late and
    coarse by itself, so the port adds neither delay nor sensors.
    """
    on -= {"delay", "quantisation"} if external else set()
    scene, d = system.scene, system.mechanism.nv
    held = system.tool_tree >= 0
    if not held and not isinstance(coupling, NoCoupling):
        raise ArgumentError("coupling", coupling.name, f"none: scene {scene.name} has no hand, so no device")
    device = system.device_mechanism() if held else system.mechanism
    (v_start, v_stop), (q_start, q_stop) = system.tool_dofs, system.tool_coordinates
    state = system.make_state()
    q, v = state.q[q_start:q_stop].copy(), state.v[v_start:v_stop].copy()
    mass = device.mass_matrix(q) if held else np.zeros((0, 0))
    lower = np.zeros_like(mass)
    cholesky(mass, lower)
    zeros: dict[str, Any] = {name: np.zeros(d) for name in (
        "hand_force", "coupling_force", "environment_force", "applied")}
    tool_zeros: dict[str, Any] = {name: np.zeros(v_stop - v_start) for name in (
        "device_hand_force", "device_force", "pulse_force", "error", "acceleration", "measured_v")}
    return block(Port(
        coupling=coupling.kind, tool_tree=system.tool_tree, q_start=q_start, q_stop=q_stop, v_start=v_start,
        v_stop=v_stop, mechanism=device.arrays, body=device.workspace(),
        varying_inertia=not device.has_constant_mass_matrix, device_q=q, device_v=v, device_mass=mass,
        device_lower=lower, sensed_q=q.copy(), measured_q=q.copy(), engaged=np.zeros(1, np.bool_),
        clock=np.zeros(1, np.int64), **_hand(system, device), **_gains(coupling, v_stop - v_start),
        **_actuators(scene, (q_stop - q_start, v_stop - v_start), on),
        **_pulses(scene, system.dt, v_stop - v_start, "waveform" in on),
        **zeros, **tool_zeros,
    ))  # fmt: skip


def force_limit(scene: Scene) -> tuple[float, ...] | None:
    """The device's limits [N, N m], None where the scene gives none."""
    return scene.device.force_limit if scene.device is not None else None


def _hand(system: System, device: Any) -> dict[str, Any]:
    """Which body is held, where, and how it is pushed."""
    hand, wrench, point = system.scene.hand, np.zeros(6), np.zeros(3)
    if hand is None:
        return {"hand_body": -1, "device_body": -1, "hand_point": point, "wrench": wrench}
    wrench[[0, 1, 5] if len(hand.force) == 3 else slice(None)] = hand.force
    point[: len(hand.point)] = hand.point
    return {"hand_body": system.mechanism.index(hand.body), "device_body": device.index(hand.body),
            "hand_point": point, "wrench": wrench}  # fmt: skip


def _gains(coupling: Coupling, size: int) -> dict[str, Any]:
    gains = coupling.settings if not isinstance(coupling, NoCoupling) else {}
    for name, values in gains.items():
        if len(values) != size:  # the kernels would read past the end
            raise ArgumentError(f"coupling {name}", values, f"{size} values, one for each coordinate of the tool")
    return {name: _per_coordinate(gains.get(name), size) for name in ("stiffness", "damping")}


def _actuators(scene: Scene, sizes: tuple[int, int], on: frozenset[str]) -> dict[str, Any]:
    """What the device adds: limits, damping, sensors, delay."""
    (nq, size), settings, limit = sizes, scene.device, force_limit(scene)
    damped, limited, quantised = ("device_damping" in on, "device_limits" in on, "quantisation" in on)
    slots = 1 + (settings.delay if settings is not None and "delay" in on else 0)
    return {
        "device_damping": _per_coordinate(settings.damping if settings and damped else None, size), "damped": damped,
        "force_limit": _per_coordinate(limit, size, np.inf), "limited": limited,
        "resolution": _per_coordinate(settings.position_resolution if settings and quantised else None, nq),
        "quantised": quantised,
        "delayed_force": np.zeros((slots, size)), "delayed_q": np.zeros((slots, nq)),
        "delayed_v": np.zeros((slots, size)),
    }  # fmt: skip


def _pulses(scene: Scene, dt: float, size: int, shaped: bool) -> dict[str, Any]:
    """How the device gives an impulse to the hand."""
    weights = waveform_weights(scene.device.waveform if shaped and scene.device else "step", dt)
    return {"pulsed": len(weights) > 1, "pulse_weights": weights, "pulse_pending": np.zeros((len(weights), size)),
            "pulse_balance": np.zeros(1), "pulse_held": np.zeros(1, np.int64)}  # fmt: skip


def _per_coordinate(values: Any, size: int, default: float = 0.0) -> Floats:
    return np.full(size, default) if values is None else np.array(values, dtype=np.float64)
