"""From a system of many DOFs to one of few, and the way back."""
