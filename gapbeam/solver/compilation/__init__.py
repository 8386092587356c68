"""Compilation of loops by numba, and its machine code on disk."""
