"""The studies: `main_study`, and the investigations of the book, one file each.

`investigation` is what these share; `nmpcrl investigate NAME` makes their rows.
"""
