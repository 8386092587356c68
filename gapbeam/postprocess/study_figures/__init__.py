"""Figures of sweeps, identifications, trade-offs and stability maps."""
