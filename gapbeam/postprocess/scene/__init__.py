"""Pictures and films of the beam in its support."""
