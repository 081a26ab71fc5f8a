"""The pages of the built book: what they have beyond their sources."""
