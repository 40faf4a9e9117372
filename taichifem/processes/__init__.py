"""What acts on the bodies besides elasticity: what holds and pulls them, and contact."""
