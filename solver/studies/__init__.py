"""Many analyses of one case."""
