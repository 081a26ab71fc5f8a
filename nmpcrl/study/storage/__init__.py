"""The machine, and errors whose message is a sentence."""
