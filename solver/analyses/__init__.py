"""What a case can ask for: a static seat, a transient."""
