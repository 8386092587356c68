"""The compiled march of dense systems."""
