"""Messages: faults with their places, errors, and words that several of them share."""
