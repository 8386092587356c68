"""A user's own mesh: reading and checking it."""
