"""The contact problem of one step: condensation, Newton iteration and friction."""
