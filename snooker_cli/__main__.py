"""``python -m snooker_cli`` is ``snooker``."""

from snooker_cli.cli import main

main()
