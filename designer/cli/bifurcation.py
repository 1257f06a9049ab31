"""The verb ``bifurcation``."""

from __future__ import annotations

from typing import Annotated, Any

from designer.base.defaults import CURVE_DEPTH, SEED
from designer.base.errors import InputError
from designer.cli.app import Out, Output, Seed, Session, Source, option, verb


@verb(
    "Explore",
    "designer bifurcation model.toml --over omega --from 0.2 --to 1 --steps 200 --out out/sweep",
    "jobs",
    "overwrite",
    "resume",
)
def bifurcation(
    session: Session,
    model: Source,
    over: Annotated[
        str | None,
        option(
            "--over",
            "NAME",
            "omega (default), b, k0, zeta, m, k, c or f20; of format 2 a number of an element, "
            "such as A.upper; with --circuit frequency in Hz (default), omega, amplitude or "
            "offset in V; with --basins a state.",
        ),
    ] = None,
    from_: Annotated[
        str | None,
        option(
            "--from",
            "A",
            'One end of the sweep; of a file with SI values also "10 Hz" or "0.5 mm".',
        ),
    ] = None,
    to: Annotated[str | None, option("--to", "B", "The other end.")] = None,
    steps: Annotated[int | None, option("--steps", "N", "Values, both ends included.")] = None,
    omega: Annotated[
        float | None, option("--omega", "W", "The drive's frequency where it is not swept.")
    ] = None,
    frequency: Annotated[
        str | None,
        option(
            "--frequency",
            "F",
            'The same in units, such as "10 Hz"; with --circuit the generator\'s.',
        ),
    ] = None,
    down: Annotated[
        bool, option("--down", None, "Follow the attractor downwards (the default).")
    ] = False,
    up: Annotated[bool, option("--up", None, "Follow it upwards; with --down both.")] = False,
    starts: Annotated[
        int | None, option("--starts", "K", "From K starts at every value, rest first.")
    ] = None,
    periods: Annotated[
        int | None, option("--periods", "N", "Drive periods left out [500; maps 134].")
    ] = None,
    keep: Annotated[int | None, option("--keep", "N", "Drive periods shown [30; maps 16].")] = None,
    map_: Annotated[
        tuple[str, str, str, int] | None,
        option("--map", "NAME A B N", "A map over this parameter too."),
    ] = None,
    and_: Annotated[
        tuple[str, str, str] | None,
        option("--and", "NAME A B", "Continue the points as curves over this parameter too."),
    ] = None,
    depth: Annotated[
        int | None,
        option(
            "--depth",
            "K",
            "With --and: K times in a row, begin the other curves where curves meet "
            f"[{CURVE_DEPTH}].",
        ),
    ] = None,
    region: Annotated[
        str | None,
        option("--region", "V", "With --and: where the response at this value of --over lives."),
    ] = None,
    basins: Annotated[
        bool, option("--basins", None, "Where starts on a plane of states end.")
    ] = False,
    circuit: Annotated[
        bool, option("--circuit", None, "The design folder's circuit, in Hz and volts.")
    ] = False,
    points: Annotated[
        bool, option("--points/--no-points", None, "Locate the bifurcation points.")
    ] = True,
    shares: Annotated[
        int | None,
        option("--shares", "K", "Count on which attractor K random starts end at every value."),
    ] = None,
    box: Annotated[
        list[str] | None,
        option("--box", "STATE=A:B", "Draw a state of these starts from A to B; may be repeated."),
    ] = None,
    seed: Seed = SEED,
    out: Out = None,
    **shared: Any,
) -> Output:
    """Draw bifurcation diagrams, maps of n-p-q over two parameters, or basins of attraction."""
    from designer.cli import bifurcation_tables
    from designer.jobs import bifurcation_job

    result = bifurcation_job.bifurcation(
        model,
        over=over,
        from_=from_,
        to=to,
        steps=steps,
        omega=omega,
        frequency=frequency,
        down=down,
        up=up,
        starts=starts,
        periods=periods,
        keep=keep,
        map_=map_,
        and_=and_,
        depth=depth,
        region=region,
        basins=basins,
        circuit=circuit,
        points=points,
        shares=shares,
        box=[_limits(text) for text in box or ()],
        seed=seed,
        out=out,
        progress=session.progress,
        **shared,
    )
    ends = (from_ or "", to or "")
    return Output(
        result.answer, lambda: bifurcation_tables.show(result.answer, out, result.reused, ends)
    )


def _limits(text: str) -> tuple[str, str, str]:
    """State, least and greatest value of an option such as "x1=-0.5:0.5".

    Raises
    ------
    InputError : it has no "=" or no ":".
    """
    state, equals, limits = text.partition("=")
    low, colon, high = limits.partition(":")
    if not equals or not colon:
        raise InputError(None, "--box", text, "STATE=A:B, such as x1=-0.5:0.5")
    return state.strip(), low.strip(), high.strip()
