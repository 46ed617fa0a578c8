"""The haptic side (paper V-C, VI): rendering of impulses, couplings between device and tool, the
device."""
