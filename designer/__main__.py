"""``python -m designer``."""

from __future__ import annotations

from designer.cli.entry import main

if __name__ == "__main__":
    main()
