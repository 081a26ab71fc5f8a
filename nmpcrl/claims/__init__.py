"""From numbers to verdicts: what the paper claims, what became of it, and what that depends on."""
