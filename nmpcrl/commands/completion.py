"""`nmpcrl completion`: what a shell needs to complete commands, options and names."""

import click
from click.shell_completion import get_completion_class

SHELLS = ("bash", "zsh", "fish")
VARIABLE = "_NMPCRL_COMPLETE"  # by which the shell asks


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Print the script by which a shell completes what you type.

    Evaluate it in the file that your shell reads when it starts.

    \b
    Example:
      echo 'eval "$(nmpcrl completion bash)"' >> ~/.bashrc
      echo 'eval "$(nmpcrl completion zsh)"' >> ~/.zshrc
      nmpcrl completion fish > ~/.config/fish/completions/nmpcrl.fish
    """
    kind = get_completion_class(shell)
    if kind is None:
        raise click.ClickException(f"nothing is known of {shell}")
    click.echo(kind(ctx.find_root().command, {}, "nmpcrl", VARIABLE).source())
