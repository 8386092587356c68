"""The semi-discrete system M a + C v + K u = f + contact, and the operators behind it."""
