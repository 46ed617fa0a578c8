"""Sweeps: one scene, many values. A study says which (`study`), `points` spells them out, `work` computes one of
them into a run file, `schedule` hands them to processes or to a cluster, `sweep` keeps the results."""
