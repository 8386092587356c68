"""Call the command line, and print the modules that it loaded as the last line."""

import json
import sys

from gapbeam.command_line import main

if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    finally:
        print("\n" + json.dumps(sorted(sys.modules)))
