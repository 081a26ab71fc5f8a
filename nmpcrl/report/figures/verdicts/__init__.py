"""Verdicts: each claim, why runs went wrong, and where a verdict changes."""
