"""Time integration schemes."""
