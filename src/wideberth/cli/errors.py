"""What people see when a command fails: one line and the right exit status, never a traceback."""

import functools
import os
import sys
import tempfile
import traceback
from collections.abc import Callable
from typing import ParamSpec

import typer

from wideberth.errors import InputError

P = ParamSpec("P")

BAD_INPUT = 2
INTERNAL_ERROR = 1
INTERRUPTED = 130  # 128 + SIGINT
BROKEN_PIPE = 141  # 128 + SIGPIPE


def guarded(command: Callable[P, None]) -> Callable[P, None]:
    """Return the command with its errors turned into one line on standard error and an exit status."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        try:
            command(*args, **kwargs)
            sys.stdout.flush()
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except InputError as error:
            _fail(str(error), BAD_INPUT)
        except KeyboardInterrupt:
            _fail("interrupted", INTERRUPTED)
        except BrokenPipeError:
            # The reader has gone; without this the interpreter complains again when it flushes at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(BROKEN_PIPE) from None
        except OSError as error:
            if error.filename is None:
                _internal_error(error)
            _fail(f"{error.filename}: {error.strerror}", BAD_INPUT)
        except Exception as error:
            _internal_error(error)

    return run


def quantity(option: str, text: str, dimension: str) -> float:
    """Return what an option says in SI units (`units.parse_quantity`), or an error that names the option."""
    from wideberth.units import parse_quantity

    try:
        return parse_quantity(text, dimension)
    except ValueError as error:
        raise InputError(f"{option}: {error}") from None


def _fail(message: str, status: int) -> None:
    typer.echo(f"wideberth: {message}", err=True)
    raise typer.Exit(status) from None


def _internal_error(error: Exception) -> None:
    with tempfile.NamedTemporaryFile(
        "w", prefix="wideberth-error-", suffix=".txt", delete=False, encoding="utf-8"
    ) as file:
        file.write(f"{' '.join(sys.argv)}\n\n")
        file.writelines(traceback.format_exception(error))
    what = f"{type(error).__name__}: {error}".splitlines()[0]
    _fail(f"this is a fault in wideberth ({what}); please report it with {file.name}", INTERNAL_ERROR)
