"""`python -m skein_reference FOLDER`: write the generated pages without Sphinx."""

import sys
from pathlib import Path

from skein_reference import write

write(Path(sys.argv[1]))
