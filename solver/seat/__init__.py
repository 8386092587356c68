"""The static seat, and the start of a run."""
