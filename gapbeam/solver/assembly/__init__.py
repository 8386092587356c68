"""Finite elements of the body: stiffness, mass, loads and probes."""
