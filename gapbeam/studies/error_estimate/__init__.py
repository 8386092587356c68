"""How far the figures of a run may be off: estimates from cheap companions of the run."""
