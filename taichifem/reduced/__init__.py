"""Linear bodies with few unknowns: vibration modes, condensation to the surface, boundary elements."""
