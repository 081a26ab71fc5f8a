"""How many processes a command may start."""

import click


def check(workers: int | None, *, sure: bool) -> None:
    """Refuse more workers than there is room for, unless somebody is sure.

    Raises:
        ParameterError: it is no number of workers.
        click.ClickException: there is no room for them.
    """
    from nmpcrl.study.parameters import ParameterError
    from nmpcrl.study.storage.executor import check_workers

    if workers is None:
        return
    check_workers(workers, sure=True)
    try:
        check_workers(workers, sure=sure)
    except ParameterError as error:
        raise click.ClickException(f"{error}; --yes starts them nevertheless") from None
