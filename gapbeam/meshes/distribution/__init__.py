"""Distribution of cells to ranks, and work of rank 0."""
