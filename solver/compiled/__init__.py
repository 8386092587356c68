"""Time loops of dense systems, compiled: no Python in a step."""
