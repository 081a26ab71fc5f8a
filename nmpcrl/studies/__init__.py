"""The investigations of the book, one file each; `nmpcrl investigate NAME` makes their rows."""
