"""`python -m nmpcrl` is the command `nmpcrl`."""

from nmpcrl.commands import main

if __name__ == "__main__":
    main(prog_name="nmpcrl")
