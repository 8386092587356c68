"""How cells are distributed to ranks, and work of rank 0."""
