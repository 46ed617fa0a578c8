"""A mass at a sampled wall with exact motion between the samples (C21), and the hand's port (C20)."""
