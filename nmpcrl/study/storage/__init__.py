"""How any job is run on many processes, and how any file is kept: nothing here knows a run.

Jobs: `executor` on `workers`, which hand back an `outcome` and end with their parent (`orphans`).
Files: an `archive` written by `atomic` in the folder of `place`, under a `reservation`.
"""
