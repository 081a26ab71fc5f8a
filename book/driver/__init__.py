"""The driver of the book: what the commands beside this folder do."""
