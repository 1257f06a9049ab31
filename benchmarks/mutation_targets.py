"""Which files are mutated, and which tests ought to notice: one group for each thing that a user
relies on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A file of ``designer`` and its tests."""

    module: str
    """Path below the root."""
    tests: tuple[str, ...]
    """Files of tests below the root, the most direct ones first."""

    @property
    def compiled(self) -> bool:
        """Whether numba compiles it: nobody sees which of its lines a test runs."""
        return self.module.rpartition("/")[2].startswith("kernel_")


def _of(package: str, modules: str, tests: str) -> tuple[Target, ...]:
    """Modules of a package that have the same tests, all as words."""
    files = tuple(f"tests/{folder}/test_{name}.py" for folder, name in _pairs(tests))
    return tuple(Target(f"designer/{package}/{name}.py", files) for name in modules.split())


def _pairs(tests: str) -> list[tuple[str, str]]:
    pairs = []
    for word in tests.split():
        folder, _, name = word.partition("/")
        pairs.append((folder, name))
    return pairs


GROUPS: Mapping[str, tuple[Target, ...]] = {
    "reduction": (
        *_of(
            "circuit", "reduction", "circuit/reduction circuit/rectifier synthesis/drive_channels"
        ),
        *_of("circuit", "nodal", "circuit/reduction circuit/nodal_bandwidth circuit/any_system"),
        *_of("circuit", "nodal_bandwidth", "circuit/nodal_bandwidth circuit/rectifier_bandwidth"),
        *_of("circuit", "ensemble", "circuit/ensemble circuit/ensemble_of_any_size"),
        *_of("circuit", "board_modes", "circuit/any_system fabrication/bench_sheet"),
    ),
    "matching": (
        *_of("circuit", "terms", "circuit/terms linear_network/term_search"),
        *_of("circuit", "coefficients", "circuit/coefficients circuit/any_system"),
        *_of(
            "linear_network",
            "linear_block linear_terms term_search",
            "linear_network/linear_block linear_network/linear_search linear_network/term_search",
        ),
        *_of("synthesis", "stop_halves", "synthesis/stop_halves"),
        *_of("synthesis", "value_tables", "synthesis/value_tables synthesis/parts_choice"),
        *_of(
            "synthesis", "dead_zone_target", "synthesis/nonlinear_block linear_network/term_search"
        ),
        *_of(
            "synthesis",
            "side_conditions limits",
            "synthesis/side_conditions design_rules/rules_circuit",
        ),
        *_of("synthesis", "scale_choice scale_box", "synthesis/scale_choice"),
    ),
    "verdicts": (
        *_of("verdicts", "verdict", "verdicts/verdict verdicts/exact_circuit"),
        *_of("verdicts", "exact_circuit", "verdicts/exact_circuit yields/window_path"),
        *_of(
            "model",
            "response_table",
            "verdicts/verdict model/model_file centering/operating_points",
        ),
        *_of("dynamics", "orbit counts", "dynamics/counts dynamics/attractors verdicts/verdict"),
    ),
    "yields": (
        *_of("base", "proportion", "base/proportion"),
        *_of("yields", "yield_count", "yields/yield_count yields/two_engine_yield"),
        *_of("spread", "tilted_cube", "yields/rare_losses"),
        *_of("yields", "rare_losses drawn_boards loss_regions", "yields/rare_losses"),
        *_of("spread", "loss_walks", "spread/loss_walks"),
        *_of("yields", "trimmed_yield", "yields/trimmed_yield"),
        *_of("yields", "window_path", "yields/window_path"),
    ),
    "flow guards": (
        *_of(
            "dynamics",
            "piecewise_linear",
            "dynamics/piecewise_linear dynamics/force_laws circuit/reduction "
            "synthesis/drive_channels",
        ),
        *_of("dynamics", "step_budget", "dynamics/step_budget"),
        *_of("dynamics", "flow", "dynamics/step_budget dynamics/flow dynamics/drive_shape"),
        *_of("dynamics", "working_modes", "dynamics/piecewise_linear kernels/kernel_propagators"),
        *_of("kernels", "kernel_crossing kernel_modal", "dynamics/flow dynamics/event_by_event"),
        *_of("kernels", "kernel_general", "dynamics/event_by_event dynamics/several_clearances"),
    ),
    "design rules": (
        *_of(
            "design_rules",
            "on_nets on_parts on_precision on_ratings rule_subject",
            "design_rules/rules_circuit design_rules/rules_parts",
        ),
        *_of("design_rules", "on_board", "design_rules/rules_board design_rules/rules_copper"),
        *_of("design_rules", "on_fab", "design_rules/on_fab"),
        *_of("design_rules", "run_rules", "design_rules/run_rules"),
    ),
}
