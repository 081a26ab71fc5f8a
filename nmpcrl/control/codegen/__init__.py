"""CasADi writes the mathematics, numba compiles it."""
