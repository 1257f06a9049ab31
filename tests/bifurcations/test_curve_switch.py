"""The other curve at points of codimension two, against closed forms and independent solves.

The orbits of ``test_codimension_two_independently`` (pieces of SciPy's matrix exponential) and of
``test_resonances_with_impacts`` (DOP853), whose equations are nothing of the package's.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from designer.base.arrays import Array
from designer.bifurcations.border_curve import BorderCurve, CurveMeeting, CurveOrigin, read_curve
from designer.bifurcations.border_curves import CurvePlan, run
from designer.bifurcations.codimension_two import CodimensionTwo
from designer.bifurcations.curve_switch import OtherCurve, other_curve, read_other_curve, switched
from designer.bifurcations.extended_system import CurvePoint
from designer.bifurcations.plane_curves import PlaneCurve, PlaneWindow, followed
from designer.bifurcations.points import PointKind
from designer.bifurcations.windows import window
from designer.dynamics.attractors import settle
from designer.folders.sweep_store import WorkFiles, curve_blocks
from designer.model.swept_model import ModelSubject
from tests.bifurcations import test_resonances_with_impacts as resonant
from tests.bifurcations.test_codimension_two_independently import (
    curve_of_the_fold,
    plane_of,
    solved,
    two_coupled,
)
from tests.bifurcations.test_continuation import PAPER
from tests.bifurcations.test_plane_curves import curve, located

COUPLED = PlaneWindow((1.09, 1.22), (0.068, 0.08))
RESONANT = PlaneWindow((-0.05, 0.05), (1.85, 1.91))


def _switched(parent: PlaneCurve, met: CodimensionTwo, window: PlaneWindow) -> PlaneCurve:
    """The other curve at a point of codimension two of a curve."""
    start = other_curve(parent.system, met)
    assert start is not None
    # What is kept on disk is enough to begin it.
    kept = read_other_curve(start.as_dict(), start.values, symmetric=start.symmetric)
    assert kept == start
    found = switched(parent.system.plane, kept, met.name, window)
    assert found is not None
    assert found.points[found.begun].values == met.values
    return found


@cache
def _at_the_fold_flip() -> tuple[PlaneCurve, PlaneCurve]:
    """The fold curve of two coupled oscillators, and the doubling curve that crosses it."""
    fold = curve_of_the_fold(plane_of(two_coupled, 0.07, 1.1), 4, 1.1, 0.07, COUPLED)
    (met,) = fold.codimension_two
    return fold, _switched(fold, met, COUPLED)


@pytest.mark.slow
def test_the_doubling_curve_that_crosses_a_fold_at_a_fold_flip() -> None:
    """All conditions of a doubling at 12 of its points, in closed form."""
    fold, flip = _at_the_fold_flip()
    assert (flip.kind, flip.ends) == (PointKind.DOUBLING, ("edge of c", "edge of c"))
    for k in np.linspace(0, len(flip.points) - 1, 12).astype(int):
        z = flip.points[k].z

        def equations(u: Array, c: float = float(z[5])) -> Array:
            end, M = two_coupled(c).period(u[:4], u[4])
            return np.array([*(end - u[:4]), np.linalg.det(M + np.eye(4))])

        root = solved(equations, z[:5] + 1e-7)
        assert z[4] == pytest.approx(root[4], abs=1e-8)
        assert z[:4] == pytest.approx(root[:4], abs=1e-6)
    at = min(fold.points, key=lambda p: fold.system.distance(p.z, flip.points[flip.begun].z))
    assert abs(float(at.tangent @ flip.points[flip.begun].tangent)) < 0.9


@pytest.mark.slow
def test_from_the_doubling_back_to_the_fold() -> None:
    """A curve through the fold-flip that is begun elsewhere meets the fold there, too."""
    fold, flip = _at_the_fold_flip()
    place = flip.points[-1].values
    beyond = replace(COUPLED, second=(place[1] - 1e-3, 0.08))
    again = followed(flip.system, flip.points[-1], flip.response, beyond)
    (met,) = again.codimension_two
    assert met.name == "fold-flip"
    assert met.values == pytest.approx(flip.points[flip.begun].values, abs=1e-9)
    back = _switched(again, met, COUPLED)
    ends = sorted(p.values for p in (back.points[0], back.points[-1]))
    assert ends == [
        pytest.approx(p.values, abs=1e-9)
        for p in sorted((fold.points[0], fold.points[-1]), key=lambda p: p.values)
    ]


@pytest.mark.slow
def test_the_torus_curve_begins_at_the_1_2_resonance_of_a_doubling() -> None:
    """It lies where damping vanishes (Liouville), on the side on which the pair is complex."""
    within = PlaneWindow((2.0, 2.3), (-0.05, 0.1))
    doubling = resonant.curve(PointKind.DOUBLING, "omega", 2.1, within, 0.0)
    (met,) = [c for c in doubling.codimension_two if c.name == "1:2 resonance"]
    torus = _switched(doubling, met, within)
    assert (torus.kind, torus.ends) == (PointKind.TORUS, ("1:2 resonance", "edge of omega"))
    assert np.abs(torus.values[:, 1]).max() < 1e-9
    for p in torus.points[1::5]:
        _, M = resonant.monodromy(p.z[:2], 0.0, p.values[0], 1, 0.0)
        assert abs(np.trace(M)) < 2.0
        assert np.sort_complex(p.multipliers) == pytest.approx(
            np.sort_complex(np.linalg.eigvals(M)), abs=1e-6
        )


@pytest.mark.slow
def test_the_fold_that_ends_a_torus_curve_at_its_1_1_resonance() -> None:
    """x'' + c x' + x = sin ωt with a stop: det(M - 1) = 0 where det M = exp(- c T), T = 6π/ω."""
    torus = resonant.curve(PointKind.TORUS, "c", 1.89, RESONANT, 0.0)
    (met,) = [c for c in torus.codimension_two if c.name == "1:1 resonance"]
    fold = _switched(torus, met, RESONANT)
    assert (fold.kind, fold.ends) == (PointKind.FOLD, ("edge of c", "edge of c"))
    # Damping c and -c: time reversed, the same orbit. So the curve is its own mirror image.
    c, omega = fold.values[:, 0], fold.values[:, 1]
    order = np.argsort(c)
    assert np.interp(-c, c[order], omega[order]) == pytest.approx(omega, abs=1e-5)
    for p in fold.points[::6]:
        others = p.condition.others(p.multipliers)
        determinant = np.exp(-p.values[0] * 6.0 * np.pi / p.values[1])
        assert float(others[0].real) == pytest.approx(determinant, abs=1e-8)
    # And from the fold back to the torus curve, which lies on one side of the fold.
    within = replace(RESONANT, first=(-0.04, 0.05))
    again = followed(fold.system, fold.points[int(np.argmax(c))], fold.response, within)
    (met,) = again.codimension_two
    assert met.name == "1:1 resonance"
    assert met.values == pytest.approx(torus.points[0].values, abs=1e-8)
    back = _switched(again, met, RESONANT)
    assert back.ends == ("1:1 resonance", "edge of omega")
    assert np.abs(back.values[:, 0]).max() < 1e-9


@pytest.mark.slow
def test_the_pitchfork_that_ends_at_a_grazing() -> None:
    """From the grazing of 1-2-2 the pitchfork is begun on the side that does not touch; it is the
    one that ends there from the other side, and passes points that are located one by one."""
    grazing, fork = curve(PointKind.GRAZING, 0.76644), curve(PointKind.PITCHFORK, 0.8562)
    within = PlaneWindow((0.6, 1.8), (0.15, 0.35))
    (met,) = grazing.codimension_two
    other = _switched(grazing, met, within)
    assert other.ends == ("grazing meets pitchfork", "edge of b")
    assert other.points[-1].values == pytest.approx(fork.points[-1].values, abs=1e-9)
    for k in (1, 2, len(other.points) // 2):
        values = located(other, other.points[k])
        assert min(abs(v - other.points[k].values[0]) for v in values) < 1e-8
    back = _switched(fork, fork.codimension_two[0], within)
    assert back.kind is PointKind.GRAZING
    assert sorted(p.values for p in _ends(back)) == [
        pytest.approx(p.values, abs=1e-9) for p in sorted(_ends(grazing), key=lambda p: p.values)
    ]
    plain = BorderCurve.of(grazing)
    assert read_curve(plain.as_dict()).as_dict() == plain.as_dict()


def _ends(followed: PlaneCurve) -> tuple[CurvePoint, CurvePoint]:
    return followed.points[0], followed.points[-1]


@pytest.mark.slow
def test_a_fold_that_the_sweep_does_not_cross_is_had_from_a_grazing_that_it_meets(
    tmp_path: Path,
) -> None:
    """The grazing that ends 1-8-8 above, followed down in b, meets the fold that ends 1-7-7 there.
    Along b = 0.25 the sweep crosses the grazing alone."""
    over = ModelSubject(PAPER, 0.215).family("omega")
    stable = window(over, settle(over.flow(0.215), np.zeros(4)), 0.215, 0.21, 0.23)
    assert stable.high.point is not None
    within = PlaneWindow((0.2175, 0.24), (0.215, 0.255))
    plan = CurvePlan(ModelSubject(PAPER), "omega", "b", 0.25, within, depth=1)
    store = curve_blocks(plan, WorkFiles(tmp_path, "work", {}))
    grazing, fold = run(plan, [stable.high.point], store=store)
    assert (grazing.kind, grazing.begun_at) == ("grazing", None)
    (met,) = [m for m in grazing.codimension_two if m.name == "grazing meets fold"]
    assert (met.status, met.curve) == ("followed", 2)
    assert (fold.kind, fold.response, fold.symmetric) == ("fold", "1-7-7", True)
    assert fold.begun_at == CurveOrigin(1, met.name, met.values)
    assert fold.ends == ("grazing meets fold", "edge of b")
    assert tuple(fold.points[0]) == met.values
    assert all(fold.stable)
    # Each of its points by the continuation over one parameter, from the orbit that is kept there.
    followed = switched(plan.subject.plane("omega", "b"), _kept(met), met.name, within)
    assert followed is not None
    for k in (2, len(followed.points) // 2, len(followed.points) - 2):
        p = followed.points[k]
        assert min(abs(v - p.values[0]) for v in located(followed, p)) < 1e-8
    # What was not finished is done anew, and the same.
    for block in range(8, 16):
        (tmp_path / store.name(block)).unlink()
    again = run(plan, [stable.high.point], store=store)
    assert [c.as_dict() for c in again] == [c.as_dict() for c in (grazing, fold)]
    alone = run(replace(plan, depth=0), [stable.high.point])
    assert [c.kind for c in alone] == ["grazing"]
    assert {m.status for m in alone[0].codimension_two} == {"deeper than asked for"}


@pytest.mark.slow
def test_both_sides_of_the_corner_in_which_a_pitchfork_meets_a_grazing() -> None:
    """The pitchfork that ends 1-8-8 below comes to the grazing from the side that touches; the one
    of 1-7-7 is begun from the grazing on the other side, and ends there too."""
    over = ModelSubject(PAPER, 0.215).family("omega")
    stable = window(over, settle(over.flow(0.215), np.zeros(4)), 0.215, 0.21, 0.23)
    points = [end.point for end in (stable.low, stable.high) if end.point is not None]
    within = PlaneWindow((0.2105, 0.2205), (0.235, 0.255))
    plan = CurvePlan(ModelSubject(PAPER), "omega", "b", 0.25, within)
    grazing, grazed, clear = run(plan, points)
    (met,) = grazing.codimension_two
    assert (grazed.response, clear.response) == ("1-8-8", "1-7-7")
    assert grazed.ends == clear.ends == ("grazing meets pitchfork", "edge of b")
    assert grazed.points[0] == pytest.approx(met.values, abs=1e-9)
    assert clear.points[0] == pytest.approx(met.values, abs=1e-9)
    assert grazed.points[1][1] > met.values[1] > clear.points[1][1]
    assert (grazed.begun_at, clear.begun_at) == (None, CurveOrigin(1, met.name, met.values))
    assert met.curve == 3


def _kept(met: CurveMeeting) -> OtherCurve:
    assert met.other is not None
    return met.other
