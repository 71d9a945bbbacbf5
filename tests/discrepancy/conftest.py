"""The problem that tests of the searches share is in ``linear_problem.py``."""

from __future__ import annotations

import sys
from pathlib import Path

# Under every import mode of pytest.
sys.path.insert(0, str(Path(__file__).parent))
