"""The step-by-step march, for every model and scheme."""
