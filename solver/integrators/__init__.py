"""Time integration schemes, one per file."""
