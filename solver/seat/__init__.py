"""The static seat."""
