"""Compiled contact kernels: they read arrays, write `out`, return a status and allocate nothing in
a step."""
