"""Finite element forms of the body: stiffness, mass, loads and probes."""
