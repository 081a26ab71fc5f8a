"""Editions of the chapters for a course, and their slides."""
