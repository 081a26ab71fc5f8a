"""Runs: their curves, their rollouts, and one run looked at closely."""
