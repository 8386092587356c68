"""Contact: laws, formulations and the contact problem of a step."""
