"""From a case to a model: finite elements, reduced basis, beam elements or rigid body."""
