"""Assumptions behind the equations, and what a march measures to watch them."""
