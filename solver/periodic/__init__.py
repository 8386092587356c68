"""Periodic responses: shooting, Floquet multipliers, continuation, harmonic balance."""
