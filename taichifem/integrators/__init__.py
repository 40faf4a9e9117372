"""Ways to advance time by one step."""
