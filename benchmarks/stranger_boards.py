"""What a finished design of a stranger's system does: its nominal circuit, and boards of it.

As a process of its own (``python -m benchmarks.stranger_boards DIR BOARDS``), since a circuit that
does not settle may take long; prints one JSON object.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from designer.base.defaults import cores
from designer.base.design_folder import Folder
from designer.catalog.parts_catalog import load_catalog
from designer.check import checked_design
from designer.dynamics.orbit import OrbitStatus
from designer.folders import design_files
from designer.folders.model_source import source
from designer.model.find_responses import matches
from designer.verdicts.exact_circuit import block
from designer.yields.study_plan import plan_study


def boards(folder: Path, samples: int) -> dict[str, Any]:
    """Of the first response: what the model and the nominal circuit show, whether that is what is
    wanted, and the verdicts on so many boards (nothing without a nominal period)."""
    modelfile, place = source(folder, None)
    synthesis = design_files.load(Folder(place), modelfile, load_catalog())
    checked = checked_design.check(synthesis.design, synthesis.model_responses, None)
    first = checked[0]
    out: dict[str, Any] = {
        "model": first.model.orbit.response,
        "nominal": first.circuit.response,
        "shown": matches(first.circuit, first.model.spec),
        "threshold_v": synthesis.design.errors.scales.threshold,
        "boards": None,
    }
    if first.model.found and first.circuit.status is OrbitStatus.PERIODIC:
        plan = plan_study(
            modelfile, synthesis.design, checked[:1], synthesis.catalog, samples=samples, seed=1
        )
        answers = block(plan, range(samples), cores())
        out["boards"] = dict(Counter(str(answer.verdict) for answer in answers))
        out["instead"] = dict(Counter(a.response for a in answers if a.reason).most_common(3))
    return out


if __name__ == "__main__":
    print(json.dumps(boards(Path(sys.argv[1]), int(sys.argv[2]))))
