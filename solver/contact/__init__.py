"""Pointwise contact laws."""
