"""The samples of these tests are a module beside them."""

from __future__ import annotations

import sys
from pathlib import Path

# Under every import mode of pytest; a module called conftest could be another folder's.
sys.path.insert(0, str(Path(__file__).parent))
