"""Page of every verb of the command line, with its arguments, options and examples."""

from collections.abc import Iterator

import click

from groundstation.cli.main import groundstation
from skein_reference.markdown import code, page, prose, table

_PROGRAM = "groundstation"
_INTRODUCTION = """\
Generated from the command line itself; each command prints the same with `--help`. A command ends with one of the
[exit codes](exit-codes.md)."""


def commands() -> str:
    """Return the page."""
    return page("Commands", _INTRODUCTION, *(_command(context) for context in contexts(_root())))


def _root() -> click.Context:
    return click.Context(groundstation, info_name=_PROGRAM)


def contexts(context: click.Context) -> Iterator[click.Context]:
    """Yield every command below one, in the order of the help."""
    group = context.command
    assert isinstance(group, click.Group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        inner = click.Context(command, info_name=name, parent=context)
        yield inner
        if isinstance(command, click.Group):
            yield from contexts(inner)


def _command(context: click.Context) -> str:
    command = context.command
    level = "##" if context.parent is None or context.parent.parent is None else "###"
    parts = [f"{level} {context.command_path}", *_paragraphs(command.help or "")]
    if not isinstance(command, click.Group):
        parts.append(f"```text\n{context.command_path} {' '.join(command.collect_usage_pieces(context))}\n```")
    if options := [_row(one, context) for one in command.params if isinstance(one, click.Option)]:
        parts.append(table(("option", "default", "meaning"), options))
    return "\n\n".join([*parts, *_paragraphs(command.epilog or "")])


def _paragraphs(text: str) -> Iterator[str]:
    """Yield the paragraphs of a help text; those marked with click's \\b keep their lines."""
    for paragraph in text.split("\n\n"):
        lines = [line.strip() for line in paragraph.splitlines()]
        if lines and lines[0] == "\b":
            shown = lines[2:] if lines[1].startswith("Example") else lines[1:]
            yield "\n".join(["```text", *shown, "```"])
        elif paragraph:
            yield prose(paragraph)


def _row(option: click.Option, context: click.Context) -> tuple[str, str, str]:
    names = ", ".join(code(name) for name in (*option.opts, *option.secondary_opts))
    value = "" if option.is_flag or option.count else f" {code(option.make_metavar(context))}"
    limits = option.get_help_extra(context).get("range")
    return names + value, _default(option), prose(option.help or "") + (f" ({code(limits)})" if limits else "")


def _default(option: click.Option) -> str:
    if option.required:
        return "required"
    plain = isinstance(option.default, str | int | float) and not isinstance(option.default, bool)
    return code(option.default) if plain and option.default != "" else ""
