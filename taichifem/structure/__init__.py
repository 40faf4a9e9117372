"""What of a mesh the solver sees: neighbours, groups of nodes, levels. NumPy and SciPy only."""
