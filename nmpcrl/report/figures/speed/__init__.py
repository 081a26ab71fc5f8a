"""How fast: the solver, learning steps and whole runs."""
