"""The block matrix, its pattern, and the solver."""
