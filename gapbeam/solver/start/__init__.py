"""The state at t = 0: seated, undeformed or centered, with a rigid motion or a vibration mode added."""
