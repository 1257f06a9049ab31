"""The design of the highest yield as stages of a design folder: what is searched, what is written.

A found design is written as any other: ``model.toml`` is the model file with everything filled in,
``asked.toml`` the one that was given.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.base import progress
from designer.base.design_folder import ASKED, DESIGN_FILES, MODEL, Folder
from designer.base.errors import InputError
from designer.base.manifest import MANIFEST
from designer.base.plain_json import FORMAT, dumps
from designer.base.second_process import other_process
from designer.base.version import __version__
from designer.catalog.parts_catalog import load_catalog
from designer.centering.answer_cache import AnswerCache
from designer.centering.design_search import look, search as design_search
from designer.centering.levers import DesignChoice
from designer.centering.ngspice_check import AgreementCheck
from designer.centering.result_json import search_json
from designer.check.synthesis_result import Synthesis
from designer.folders.design_files import waveform_names
from designer.folders.design_source import design_inputs, design_stage
from designer.folders.model_source import model_file
from designer.folders.origin import provenance
from designer.jobs import fidelity_choice
from designer.jobs.fidelity_choice import SEARCH
from designer.jobs.options import Options
from designer.jobs.stage_runner import write_design
from designer.jobs.study_stage import SPICE_TIMEOUT
from designer.model.find_responses import ModelResponse
from designer.model.model_file import ModelFile
from designer.model.response_table import placed
from designer.spice.batch_backend import program_version
from designer.spice.pool import SpicePool

if TYPE_CHECKING:
    from designer.answers.search_answer import SearchFile
    from designer.answers.shared_rows import Seconds

CANDIDATES = "candidates.jsonl"
FILES = [ASKED, SEARCH, CANDIDATES]
RULES = 7
"""Number of the rules by which a search goes; whoever changes what it finds raises it."""


def searched_into(modelfile: ModelFile, out: Path, options: Options) -> ModelFile:
    """Search for a design of this model file, unless the folder has one; the folder's model file.

    Raises
    ------
    InputError, Unreachable : see ``design_search.search``; nothing was written by then, but for
        what a design could not be made of.
    EnvironmentMissing : no ngspice; raised before any work.
    """
    options.check()
    catalog, folder = load_catalog(), Folder(out)
    inputs = design_inputs(modelfile, catalog)
    inputs |= {"version": __version__, "rules": RULES, "seed": options.seed}
    todo = folder.decide(
        {"search": (inputs, [*FILES, *DESIGN_FILES, *waveform_names(modelfile)])},
        overwrite=options.overwrite,
        resume=options.resume,
        asked={"model": modelfile.text},
    )
    if not todo:
        return model_file(out / MODEL)
    is_unfinished = folder.state("search", inputs) == "unfinished"
    if (
        not (is_unfinished or options.overwrite)
        and folder.manifest
        and "design" in folder.manifest.stages
    ):
        raise InputError(
            folder / MODEL,
            "the design",
            "one that no search made",
            "another folder, or --overwrite to replace what manifest.json lists",
        )
    program_version()
    resumes = is_unfinished and options.resume
    trade = _trade_of(folder, modelfile, resumes=resumes)
    began = time.perf_counter()
    windows = look(modelfile, catalog, options.workers)
    origin = provenance(modelfile, catalog.hash, seed=options.seed, settings={"rules": RULES})
    if not resumes:
        (folder / CANDIDATES).unlink(missing_ok=True)
    # trade.json goes with its design, and so before this is done.
    folder.begin({"search": (inputs, FILES)}, origin, {"trade": trade} if trade else None)
    folder.write(ASKED, modelfile.text)
    memory = AnswerCache(folder / CANDIDATES, inputs["model"], progress.note)
    with SpicePool(options.workers, timeout=SPICE_TIMEOUT) as pool:
        searched = design_search(
            modelfile,
            catalog,
            seed=options.seed,
            jobs=options.workers,
            memory=memory,
            windows=windows,
            ask_agreement=AgreementCheck(pool, memory),
        )
    final = resolved(modelfile, searched.synthesis, searched.final.choice, out / MODEL)
    synthesis = replace(searched.synthesis, modelfile=final, seconds=time.perf_counter() - began)
    stages = design_stage(final, design_inputs(final, catalog))
    with other_process(options.workers) as other:
        write_design(folder, synthesis, stages, options, other)
    if trade is not None:
        trade = {**trade, "model": final.sha256}
    cost: Seconds = {"seconds": time.perf_counter() - began}
    document: SearchFile = {
        "format": FORMAT,
        **search_json(searched),
        "trade": trade,
        "provenance": origin,
        "cost": cost,
    }
    folder.write(SEARCH, dumps(document))
    folder.finish("search")
    return model_file(out / MODEL)


def _trade_of(folder: Folder, modelfile: ModelFile, *, resumes: bool) -> dict[str, Any] | None:
    """What a trade says that stood here when the search began, as
    ``fidelity_choice.FidelityChoice``."""
    if resumes:
        assert folder.manifest is not None
        trade: object = folder.manifest.stages["search"].resume_data.get("trade")
        if not (trade is None or isinstance(trade, dict)):
            field = "stages.search.kept.trade"
            raise InputError(folder / MANIFEST, field, trade, "the choice of a trade")
        return trade
    choice = fidelity_choice.before_search(folder, modelfile.sha256)
    return None if choice is None else asdict(choice)


def resolved(
    modelfile: ModelFile, synthesis: Synthesis, choice: DesignChoice, source: Path
) -> ModelFile:
    """The model file that a design folder holds, as if read from ``source``.

    ω and b of each response, op-amp and dead zone are values; ``objective`` stays "yield". What
    the synthesis aimed at inside its conditions is no key of a model file: the parts stand in
    ``design.json``.
    """
    return modelfile.rewritten(_tables(modelfile, synthesis.model_responses, choice), source)


def _tables(
    modelfile: ModelFile, responses: Sequence[ModelResponse], choice: DesignChoice
) -> dict[str, Any]:
    data = modelfile.data
    data.setdefault("title", modelfile.title)
    wanted = zip(modelfile.responses, responses, strict=True)
    for index, (spec, response) in enumerate(wanted):
        omega = response.omega if spec.omega is None else None
        b = response.b if isinstance(spec.b, tuple) else None
        data["response"][index] = placed(data["response"][index], omega, b, modelfile.si)
    circuit = data.setdefault("circuit", {})
    circuit |= {"opamp": choice.opamp, "dead_zone": choice.dead_zone}
    if choice.opamp != modelfile.circuit.opamp:
        circuit.pop("saturation", None)  # it was stated for the other op-amp
    order = ["format", "title", "model", "mechanical", "response", "circuit"]
    first = {key: data[key] for key in order if key in data}
    return {**first, **data}
