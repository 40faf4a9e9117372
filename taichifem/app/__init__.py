"""How people use it: the command line, and what it calls."""
