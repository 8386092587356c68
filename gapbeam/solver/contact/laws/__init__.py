"""Pointwise contact laws: springs, dampers, restitution and Coulomb friction."""
