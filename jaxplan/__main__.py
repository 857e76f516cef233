"""`python -m jaxplan` is the command `jaxplan`."""

import sys

from jaxplan.cli import main

sys.exit(main())
