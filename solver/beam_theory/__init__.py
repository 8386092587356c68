"""The Euler-Bernoulli beam on end springs of Li et al. (2013), section 2."""
