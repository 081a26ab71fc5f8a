"""Editions of the chapters for students, teachers and graders, and their slides."""
