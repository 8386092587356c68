"""The paper of Li et al. (2013), computed again."""
