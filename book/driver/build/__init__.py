"""The book built from its sources, step by step."""
