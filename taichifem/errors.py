"""The one exception for what a person can put right: bad input, a missing extra, a full disk."""


class InputError(ValueError):
    """Something a person gave is wrong. The message is one line: it names the thing and the remedy.

    The command line prints it without a traceback and exits with code 2.
    """


class Diverged(InputError):
    """The simulation met numbers that are not finite. The state before the step can still be written."""
