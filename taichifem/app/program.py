"""The command group: what goes wrong becomes one line and an exit code, never a traceback."""

from __future__ import annotations

import difflib
import sys
from typing import Any, NoReturn

import click

from taichifem.errors import InputError

UNSOLVED, BAD_INPUT, INTERRUPTED = 1, 2, 130


class Program(click.Group):
    """A click group that ends with 0, with 2 and one line on stderr for bad input, or with 130 after Ctrl-C.

    1 is left to commands that found no answer to a well-posed question.
    """

    def main(self, *args: Any, standalone_mode: bool = True, **extra: Any) -> NoReturn:
        try:
            code = super().main(*args, standalone_mode=False, **extra)
        except click.UsageError as error:
            path = error.ctx.command_path if error.ctx else "taichifem"
            message = error.format_message().rstrip(".")
            refuse(f"{message} (see: {path} --help)")
        except click.ClickException as error:
            refuse(error.format_message())
        except click.Abort:
            click.echo("taichifem: interrupted", err=True)
            sys.exit(INTERRUPTED)
        except InputError as error:
            refuse(str(error))
        except ModuleNotFoundError as error:
            refuse(f"the package {error.name!r} is not installed: install taichifem with pip, which brings it")
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            refuse(f"{place}{error.strerror or error}")
        except MemoryError:
            refuse("out of memory: ask for fewer elements or a smaller picture")
        sys.exit(code if isinstance(code, int) else 0)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple:
        if args and not args[0].startswith("-") and args[0] not in self.commands:
            ctx.fail(f"there is no command {args[0]!r}: {suggestion(args[0], self.commands)}")
        return super().resolve_command(ctx, args)


def refuse(message: str) -> NoReturn:
    """Print one line on stderr and exit with code 2."""
    click.echo("taichifem: error: " + " ".join(message.split()), err=True)
    sys.exit(BAD_INPUT)


def suggestion(name: str, known: Any) -> str:
    """What to write instead of the unknown `name`."""
    near = difflib.get_close_matches(name, known, n=1)
    return f"did you mean {near[0]!r}?" if near else f"choose one of {', '.join(known) or '(none)'}"
