"""Configuration space (paper section IV): mechanisms, their equations of motion, energy."""
