"""One scene in several worlds: distances between their motions, their energies, and the impacts as solver problems."""
