"""Coherence of a distributed random load between two places of its length."""
