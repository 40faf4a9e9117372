"""Simulations that a person acts on while they run: in a browser, in a window, or from a file of interactions."""
