"""Port: hand, coupling and device of one world, as the kernels see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iapb.mechanics.kernels import MechanismArrays, Workspace

NO_COUPLING, FOUR_CHANNEL, UNILATERAL = 0, 1, 2


class Port(NamedTuple):
    """Hand, coupling and device of one world; d velocities of the world, d_t of the tool and the device."""

    coupling: int  # NO_COUPLING, FOUR_CHANNEL, UNILATERAL
    tool_tree: int  # -1: nobody holds anything
    q_start: int  # the tool's range in q
    q_stop: int
    v_start: int  # and in v
    v_stop: int
    hand_body: int  # held body in the world
    device_body: int  # the same in the device
    hand_point: np.ndarray  # (3,) [m] held point in the body's frame
    wrench: np.ndarray  # (6,) force [N] and torque [N m] of the hand, world axes
    stiffness: np.ndarray  # (d_t,) K [N/m, N m/rad]
    damping: np.ndarray  # (d_t,) B [N s/m, N m s/rad]
    mechanism: MechanismArrays  # the device: kinematically the tool
    body: Workspace
    varying_inertia: bool
    device_q: np.ndarray  # (nq_t,)
    device_v: np.ndarray  # (d_t,)
    device_mass: np.ndarray  # (d_t, d_t)
    device_lower: np.ndarray  # (d_t, d_t)
    device_damping: np.ndarray  # (d_t,) physical damping b of the device
    damped: bool
    force_limit: np.ndarray  # (d_t,) [N, N m], inf = none
    limited: bool  # the actuators clip what they are asked for to force_limit
    resolution: np.ndarray  # (nq_t,) [m, rad] of the position sensors
    quantised: bool
    pulsed: bool  # an impulse is rendered over more than one step
    pulse_weights: np.ndarray  # (w,) shares of an impulse in the w steps after it, sum 1
    pulse_pending: np.ndarray  # (w, d_t) ring of what is still to be given [N, N m]
    pulse_force: np.ndarray  # (d_t,) given in this step
    pulse_balance: np.ndarray  # (1,) [J] lost in the tool's collisions less what the pulses gave the device
    pulse_held: np.ndarray  # (1,) int64: steps in which the observer held a pulse back
    delayed_force: np.ndarray  # (n + 1, d_t) ring of actuator forces on their way; n = 0: no delay
    delayed_q: np.ndarray  # (n + 1, nq_t) ring of measured positions on their way
    delayed_v: np.ndarray  # (n + 1, d_t)
    sensed_q: np.ndarray  # (nq_t,) what the sensors read
    measured_q: np.ndarray  # (nq_t,) what the simulation knows of the device
    measured_v: np.ndarray  # (d_t,)
    hand_force: np.ndarray  # (d,) of the hand on the tool
    device_hand_force: np.ndarray  # (d_t,) of the hand on the device
    coupling_force: np.ndarray  # (d,) on the tool
    environment_force: np.ndarray  # (d,) F_env (26)
    device_force: np.ndarray  # (d_t,) of the actuators on the device
    applied: np.ndarray  # (d,) hand and coupling together
    error: np.ndarray  # (d_t,) scratch
    acceleration: np.ndarray  # (d_t,) scratch
    engaged: np.ndarray  # (1,) bool: the unilateral coupler is on
    clock: np.ndarray  # (1,) int64: steps done
