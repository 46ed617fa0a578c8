"""Advice: which effects a scene needs, warnings before a run, distrust after it, exact certificates
of impacts."""
