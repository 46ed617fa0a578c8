"""Compiled contact kernels: arrays in, `out` written, status returned, nothing allocated in a step."""
