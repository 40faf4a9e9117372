"""The bar of `taichifem bench` in other programs. Each script is run as a plain file, maybe in another environment."""
