"""Ways to solve Eq. (2): CasADi's solvers, and one that is generated for a plant."""
