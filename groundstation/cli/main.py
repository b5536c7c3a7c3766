"""The command line: each verb imported only when it is called, and one place for errors."""

import errno
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from pkgutil import resolve_name

import click

from groundstation import plug_ins
from groundstation.cli.exits import ExitCode, exit_code_of
from groundstation.cli.verbs import RENAMED, VERBS, CommandRow, all_verbs, meant, of_kinds
from groundstation.errors import GroundStationError, SettingsError
from groundstation.process.standard_streams import make_usable


def _meant(word: str) -> str:
    from difflib import get_close_matches

    near = get_close_matches(word.lower(), ["help", *all_verbs()], 1, 0.5)
    likely = meant(word.lower()) or (f"'{near[0]}'" if near else "")
    return f" Did you mean {likely}?" if likely else ""


def _row(name: str) -> CommandRow | None:
    return VERBS.get(name) or of_kinds().get(name)


def _command(name: str, verb: CommandRow) -> click.Command:
    try:
        command = resolve_name(verb.target)
        if not isinstance(command, click.Command):
            raise TypeError(f"{verb.target} is a {type(command).__name__}, no click command")
    except Exception as error:
        if name in VERBS:
            raise
        why = f"{type(error).__name__}: {error}"
        raise GroundStationError(f"the commands of {name} cannot be used: {verb.target}: {why}") from error
    return command


class VerbGroup(click.Group):
    """A click group whose commands are imported one at a time, so that `land` does not wait for unused ones."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order of the table."""
        return list(all_verbs())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a verb, importing its module now; None for an unknown verb."""
        verb = _row(cmd_name)
        return None if verb is None else _command(cmd_name, verb)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the arguments; `help VERB` prints the same as `VERB --help`, `help all` for every command."""
        if args == ["help", "all"]:
            ctx.obj, args = "all", ["help"]
        return super().parse_args(ctx, [*args[1:], "--help"] if args[:1] == ["help"] else args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command for the first argument; an unknown one fails with the likeliest verb."""
        if args and not args[0].startswith("-") and _row(args[0]) is None:
            raise click.UsageError(f"There is no command {args[0]!r}.{_meant(args[0])}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the table of verbs by families (first page, or all), without importing any command."""
        verbs = all_verbs()
        shown = {name: verb for name, verb in verbs.items() if verb.first or ctx.obj == "all"}
        for family in dict.fromkeys(verb.family for verb in shown.values()):
            with formatter.section(family):
                formatter.write_dl([(name, verb.summary) for name, verb in shown.items() if verb.family == family])
        if len(shown) < len(verbs):
            with formatter.section("More"):
                every = f"All {len(verbs)} commands: those to prepare, study and develop as well."
                formatter.write_dl([("help all", every), ("help COMMAND", "What one command does, with its options.")])

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples and the exit codes."""
        with formatter.section("Examples"):
            formatter.write_dl(list(_EXAMPLES))
        with formatter.section("Exit codes"):
            formatter.write_dl([(str(int(code)), code.meaning) for code in ExitCode])


_EXAMPLES = (
    ("groundstation demo", "see it fly, in 60 s, on this machine"),
    ("groundstation config check lab.yaml", "name every mistake in a field file"),
    ("groundstation sitl lab.yaml --seed 3", "rehearse a field file"),
    ("groundstation fly lab.yaml", "fly it"),
    ("groundstation land", "from any other terminal"),
)


@click.command(cls=VerbGroup, name="groundstation", context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="skein-groundstation", message="%(package)s %(version)s")
def groundstation() -> None:
    """Ground station for small teams of drones that track a moving target together."""


def check_installation() -> None:
    """Raise GroundStationError if the packages come from different places: two versions would be mixed."""
    places = {}
    for package in ("groundstation", "drivers", "sim_bridge"):
        spec = find_spec(package)
        if spec is None or not spec.origin:
            raise GroundStationError(f"the package {package} is not installed beside groundstation: install again")
        places[package] = Path(spec.origin).parent.parent
    if len(set(places.values())) > 1:
        found = ", ".join(f"{package} in {place}" for package, place in places.items())
        raise GroundStationError(f"the packages come from different places ({found}): install again")


def _before_planners() -> None:
    # Imported here only: commands that stop drones must not wait for it.
    from groundstation.cli.kernels import use_kernels_of_plug_in

    use_kernels_of_plug_in()


def run(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; errors go to stderr, with a traceback only for bugs."""
    plug_ins.before_planners = _before_planners
    try:
        check_installation()
        result = groundstation.main(
            args=None if arguments is None else list(arguments), prog_name="groundstation", standalone_mode=False
        )
    except click.ClickException as error:
        (_with_new_spelling(error) if isinstance(error, click.NoSuchOption) else error).show()
        return exit_code_of(error)
    except (GroundStationError, click.Abort, KeyboardInterrupt, OSError) as error:
        _tell(error)
        return exit_code_of(error)
    return result if isinstance(result, int) else ExitCode.OK


def _with_new_spelling(error: click.NoSuchOption) -> click.NoSuchOption:
    """Suggest the new spelling for an old one, instead of options with similar letters."""
    command = error.ctx.command_path.removeprefix("groundstation ") if error.ctx else ""
    new = RENAMED.get(command, {}).get(error.option_name)
    return click.NoSuchOption(error.option_name, f"{error.option_name} is {new} here.", ctx=error.ctx) if new else error


def _tell(error: BaseException) -> None:
    match error:
        case SettingsError(problems=problems):
            count = f"{len(problems)} problem{'s' if len(problems) > 1 else ''}"
            click.echo("\n".join([*problems, f"{count}: nothing was started"]), err=True)
        case click.Abort() | KeyboardInterrupt():
            click.echo("interrupted", err=True)
        case OSError(errno=errno.EMFILE):
            click.echo(f"groundstation: {error.strerror}: raise what this shell allows (ulimit -n 1024)", err=True)
        case OSError(filename=place, strerror=why) if place is not None:
            click.echo(f"groundstation: {place}: {why}", err=True)
        case BrokenPipeError():
            sys.stderr.close()  # the reader of our output has gone; python would complain once more at exit
        case _:
            click.echo(f"groundstation: {error}", err=True)


def _of_a_bug(error: Exception) -> ExitCode:
    """Print an error that nobody foresaw; an interrupt that a library made another error of is none."""
    import traceback

    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, KeyboardInterrupt):
            _tell(cause)
            return ExitCode.INTERRUPTED
        cause = cause.__cause__ or cause.__context__
    traceback.print_exc()
    return ExitCode.BUG


def main() -> None:
    """Run the command of this process, and end it."""
    make_usable()
    try:
        code = run()
    except Exception as error:  # noqa: BLE001  the outermost loop: a bug must not look like a failed run (exit code 1)
        code = _of_a_bug(error)
    sys.exit(int(code))
