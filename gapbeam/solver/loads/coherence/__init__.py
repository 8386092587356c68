"""How alike a distributed random load is at two places of its length."""
