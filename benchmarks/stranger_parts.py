"""Another search for the parts of a stranger's system, to tell whether a refusal was right.

It shares with ``synthesise`` how a resistor follows from the scales, and no way of choosing these:
SciPy's differential evolution looks for scales that keep the limits, draws near them are rounded to
what can be bought, and each finished circuit is reduced and held to every side condition. Found
parts prove that there are some; finding none proves nothing.

    python -m benchmarks.stranger_parts FILE --seconds 60
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.optimize import Bounds, OptimizeResult, differential_evolution

from designer.base.arrays import Array
from designer.catalog.parts_catalog import load_catalog
from designer.check.synthesis_result import with_stage
from designer.circuit.coefficients import LARGE_ERROR
from designer.linear_network.linear_terms import Shortfall
from designer.model.find_responses import ModelResponse, find, peaks
from designer.model.model_file import ModelFile, read_model_file
from designer.synthesis.attempt import Order, largest_amplitudes
from designer.synthesis.limits import limits
from designer.synthesis.parts_choice import verified
from designer.synthesis.scale_choice import RoundedChoice, ScaleChoice
from designer.synthesis.scale_program import ScaleProgram

SHARES = (0.85, 0.7, 0.55, 0.4)
"""Of the op-amp's limit, that outputs are held to in turn: a circuit that is finished may swing
further than its scales say."""
ROUNDS, NEAR = 400, 0.15
"""Draws about each point that keeps the limits; their spread, in logarithms."""
EVERY = 100
"""Generations of one evolution, at most."""


def search(modelfile: ModelFile, seconds: float, seed: int = 1) -> dict[str, object]:
    """``found``, the error and the parts of the best circuit that was found within so much CPU
    time, and how many circuits were made."""
    end, made, best = time.process_time() + seconds, 0, np.inf
    values: dict[str, float] = {}
    random = np.random.default_rng(seed)
    for order, responses, choice in _orders(modelfile):
        program = choice.program
        while time.process_time() < end:
            point = _feasible(program, random, end)
            if point is None:
                break
            for z, rounded in _draws(program, point, random):
                if time.process_time() > end:
                    break
                attempt = choice.circuit_of(
                    RoundedChoice(z, rounded, error=0.0, worth=0.0, kinds=0, quiet=True)
                )
                made += 1
                if isinstance(attempt, Shortfall) or attempt.errors.max_error >= min(
                    best, LARGE_ERROR
                ):
                    continue
                design = verified(order, attempt, responses, order.spec.active_conditions)
                if all(check.holds for check in design.checks):
                    best, values = attempt.errors.max_error, attempt.circuit.values
            if values:
                return {"found": True, "max_error": best, "parts": values, "circuits": made}
    return {"found": False, "max_error": None, "parts": {}, "circuits": made}


def _orders(modelfile: ModelFile) -> Iterator[tuple[Order, tuple[ModelResponse, ...], ScaleChoice]]:
    """What is to be built, for less and less swing."""
    catalog = modelfile.choices(load_catalog())
    modelfile = with_stage(modelfile)
    model, spec = modelfile.model, modelfile.circuit
    responses = find(model, modelfile.responses)
    largest = largest_amplitudes(model, responses)
    order = Order.of(model, spec, catalog, peaks(model, responses), largest=largest)
    unit, fastest = model.second_order().own_frequency, order.peaks.fastest
    for share in SHARES:
        reach = order.output.limit * share / SHARES[0]
        within = limits(spec, spec.active_conditions, order.opamp, reach, fastest, unit=unit)
        choice = ScaleChoice(order, within)
        yield order, responses, choice


def _feasible(program: ScaleProgram, random: np.random.Generator, end: float) -> Array | None:
    """Scales that keep every limit; None where the evolution finds none in time."""
    ends = np.array([(v[0], v[-1]) if len(v) else (-20.0, 20.0) for v in program.lists])
    weights = np.array([b.log.weights for b in program.bounds])
    constants = np.array([b.log.constant for b in program.bounds])

    def missed(z: Array) -> float:
        over = np.maximum(weights @ z + constants, 0.0).sum()
        return float(over) + sum(max(s.at(z), 0.0) for s in program.sums)

    def enough(intermediate_result: OptimizeResult) -> None:
        if intermediate_result.fun <= 0.0 or time.process_time() > end:
            raise StopIteration

    found = differential_evolution(
        missed,
        Bounds(ends[:, 0], ends[:, 1]),
        maxiter=EVERY,
        tol=0.0,
        polish=False,
        rng=random,
        callback=enough,
    )
    return np.asarray(found.x) if found.fun <= 1e-9 else None


def _draws(
    program: ScaleProgram, point: Array, random: np.random.Generator
) -> Iterator[tuple[Array, Array]]:
    """Points near one, on what can be bought, with the resistors that follow rounded; the most
    exact of many."""
    scored = []
    for k in range(ROUNDS):
        z = point + (NEAR * random.standard_normal(len(point)) if k else 0.0)
        for i, values in enumerate(program.lists):
            if len(values):
                z[i] = values[np.abs(values - z[i]).argmin()]
        logs = np.array([row.log.at(z) for row in program.rows])
        rounded = np.array(
            [
                row.values[np.abs(row.values - log).argmin()]
                for row, log in zip(program.rows, logs, strict=True)
            ]
        )
        sizes = np.array([row.size for row in program.rows])
        worst = float((np.abs(rounded - logs) * sizes).max(initial=0.0))
        kept = all(b.log.at(z) <= 1e-6 for b in program.bounds)
        scored.append((not kept, worst, k, z, rounded))
    for _, _, _, z, rounded in sorted(scored, key=lambda each: each[:3])[:20]:
        yield z, rounded


def main() -> None:
    """Search for the file that is named, and print what is found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--seconds", type=float, default=60.0, help="CPU seconds")
    chosen = parser.parse_args()
    print(json.dumps(search(read_model_file(chosen.file), chosen.seconds)))


if __name__ == "__main__":
    main()
