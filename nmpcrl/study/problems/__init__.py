"""Problems of other authors, and with known solutions: each has a plan, a plant and a start."""
