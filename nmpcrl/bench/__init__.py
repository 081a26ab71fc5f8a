"""How long it takes: learning steps of learners in turns, and solves of several solvers."""
