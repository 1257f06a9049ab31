"""The yield maps of a study as files: ``maps.json`` and a picture for each map."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

from designer.yields.yield_maps import YieldMap

FORMAT = 1


def files(
    maps: Sequence[YieldMap], labels: Sequence[str], provenance: Mapping[str, Any]
) -> dict[str, bytes]:
    """Content by file name. labels : of the plan's questions, such as "ω = 0.54   1-3-3"."""
    from designer.base.figure_style import to_png
    from designer.report.map_plots import map_chart  # Matplotlib takes a while to import

    rows = []
    out: dict[str, bytes] = {}
    for found in maps:
        name = f"map-{found.over}-{found.question + 1}.png"
        picture = io.BytesIO()
        to_png(map_chart(" ".join(labels[found.question].split()), found), picture)
        out[name] = picture.getvalue()
        rows.append({"response": labels[found.question], "picture": name, **found.as_dict()})
    document = {"format": FORMAT, **provenance, "maps": rows}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    return {"maps.json": text.encode("utf-8"), **out}
