"""Mutants of the physics: small faults put into the engine one at a time, each of which some test has to notice.

`make mutants` draws a sample of them, judges each in a throw-away clone of the last commit, with the kernels
interpreted (NUMBA_DISABLE_JIT=1), and prints the share that the tests noticed. A mutant that no test notices is
either a gap in the tests or changes nothing that matters; the latter are listed with their reasons in explained.toml.

1. `calls` runs every test file once and notes which functions of the physics each test calls and how long it takes.
2. `sites` lists all places where an operator of `operators` applies, and takes a sample by a hash of place and seed.
3. `judge` changes one file of a clone and runs the tests that call the changed function, the quick ones first;
   if all of them pass, whole test files that touch it.
4. `report` prints the score of each module and the survivors.
"""
