"""Ordinary scenes with their truths, judged in our default world and in MuJoCo."""
