"""Pictures, videos, mesh sequences and statistics out of a simulation."""
