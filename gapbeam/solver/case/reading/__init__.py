"""Reading of a case file: its text becomes a case, or one error with all faults."""
