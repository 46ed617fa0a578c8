"""IAPB beside complementarity: where they agree, by how much they differ, what each costs. Plain records."""
