"""The command `nmpcrl`, which is `python -m nmpcrl`, too."""


def main() -> None:
    """Run the command; say which extra brings what it needs."""
    try:
        from nmpcrl.commands import main as command
    except ModuleNotFoundError as error:
        raise SystemExit(f"{error}: pip install 'nmpcrl[study]' brings the command") from None
    command(prog_name="nmpcrl")


if __name__ == "__main__":
    main()
