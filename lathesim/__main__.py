"""``python -m lathesim`` is the command ``lathesim``."""

from lathesim.cli.main import main

main()
