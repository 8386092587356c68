"""How much memory a model needs, how much is free, and what happens when it is used up."""
