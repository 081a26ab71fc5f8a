"""How long chapters take and what they need, plans for a course, and a self-test."""
