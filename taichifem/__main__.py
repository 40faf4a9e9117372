"""`python -m taichifem` is the command `taichifem`."""

from taichifem.app.cli import main

if __name__ == "__main__":
    main()
