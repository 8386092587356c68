"""`python -m gapbeam` is the command `gapbeam`."""

from gapbeam.command_line import main

if __name__ == "__main__":
    main()
