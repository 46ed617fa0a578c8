"""Compare IAPB with complementarity: where the laws agree, how much they differ, and what each
costs."""
