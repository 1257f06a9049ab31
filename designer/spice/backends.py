"""The two ways to drive ngspice, and which ngspice they find."""

from __future__ import annotations

from designer.spice.simulator import Backend, Simulator


def open_simulator(backend: Backend = "shared") -> Simulator:
    """The simulator of this process; a shared session is opened once and then handed out again.

    Raises
    ------
    EnvironmentMissing : ngspice is missing or too old.
    """
    if backend == "shared":
        from designer.spice.shared_backend import SharedNgspice

        return SharedNgspice.of_this_process()
    if backend == "batch":
        from designer.spice.batch_backend import BatchNgspice

        return BatchNgspice()
    raise ValueError(f'backend: found {backend!r}, expected "shared" or "batch"')


def ngspice_version() -> str:
    """Version of the ngspice program, such as ``39``, for provenance.

    It does not open a session. A study's own version is `SpicePool.version`.

    Raises
    ------
    EnvironmentMissing : ngspice is missing or too old.
    """
    from designer.spice.batch_backend import program_version

    return program_version()
