"""Ways to call the command."""

import os
import subprocess
import sys
from pathlib import Path

from click.testing import CliRunner, Result

from taichifem.app.cli import cli

CHECKOUT = Path(__file__).resolve().parents[2]


def call(*arguments: object) -> Result:
    """The command in this process."""
    return CliRunner().invoke(cli, [str(a) for a in arguments], prog_name="taichifem")


def command(*arguments: object) -> list[str]:
    """The command line for a process of its own."""
    return [sys.executable, "-m", "taichifem", *(str(a) for a in arguments)]


def environment() -> dict[str, str]:
    """With this checkout first on the path."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [str(CHECKOUT), os.environ.get("PYTHONPATH")]))}


def in_process(*arguments: object) -> subprocess.CompletedProcess:
    """The command in a process of its own."""
    return subprocess.run(command(*arguments), capture_output=True, text=True, env=environment(), timeout=120)


def assert_refused(result: Result, *words: str) -> None:
    """Exit code 2 and one line on stderr that has all the words, and no traceback."""
    assert result.exit_code == 2, result.output
    lines = result.stderr.splitlines()
    assert len(lines) == 1 and lines[0].startswith("taichifem: error: "), result.stderr
    for word in words:
        assert word in lines[0]
    assert "Traceback" not in result.output
