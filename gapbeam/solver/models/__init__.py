"""Models of a case: finite elements, reduced basis, beam elements or rigid body."""
