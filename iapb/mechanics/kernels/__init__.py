"""Compiled kernels of the mechanics room: arrays in, `out` written, nothing allocated.

Everything is expressed in world axes. Each degree of freedom k has one unit axis: it translates its body
along it or turns it about the line through the body's origin; hence one formula serves every joint kind.
Order of calls: `forward_kinematics` fills the workspace, everything else reads it.
"""
