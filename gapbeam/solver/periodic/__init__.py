"""Periodic responses: shooting, harmonic balance, continuation, stability."""
