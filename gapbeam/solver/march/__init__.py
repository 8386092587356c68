"""The march in time."""
