"""The fidelity ladder of a case: its rungs, what they cost, and how far they are from the finest."""
