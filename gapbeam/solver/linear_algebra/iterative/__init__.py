"""Conjugate gradients with multigrid, for operators whose factor does not fit in memory."""
