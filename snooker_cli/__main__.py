"""``python -m snooker_cli`` is ``snooker``."""

import os
import sys

# Python puts the current folder first on the path, and anyone may have put modules there. It stays
# if the package itself is there.
if not sys.flags.safe_path and sys.path[0] != os.path.dirname(os.path.dirname(__file__)):  # noqa: PTH120
    del sys.path[0]

from snooker_cli.cli import main

main()
