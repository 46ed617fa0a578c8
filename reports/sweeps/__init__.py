"""Sweeps: one scene simulated for many values. Module `study` reads a study and lists its points; module `sweep`
computes each point to a run file, in this process, in worker processes or on a cluster, and stores the results."""
