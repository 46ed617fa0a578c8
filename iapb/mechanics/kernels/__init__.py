"""Compiled kernels of the mechanics: they read arrays, write `out` and allocate nothing.

All vectors are in world axes. Each degree of freedom k has one unit axis. It moves its body along
this axis, or turns the body about this axis through the body's origin, so one formula serves every
joint kind. Call `forward_kinematics` first: it fills the workspace that all other kernels read.
"""
