"""The static seat, the state at t = 0, and vibration modes as contact holds the beam at the seat."""
