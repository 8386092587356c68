"""Distributed matrices, factors and solves of the finite element models."""
