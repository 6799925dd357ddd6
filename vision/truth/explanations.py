"""Which place of the bar explains a whisk's pictures: the fitted one, or another one nearby.

A fit ends near the place from which it began. Where the pictures say that another one explains them
better (`vision.truth.place_comparison`), the whisk is fitted from there as well, and the fit whose
silhouettes explain more is the truth. Where two fits explain the pictures equally well and their
distances differ, there is no number; that holds for a second bar that the search found as clear,
too, such as the shadow beside a bar. A fit that ended far from its beginning may not have
converged, and begins again from its end; one that has not converged at last says so. So a false
alarm costs the time of a fit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from vision.fit.problem import Problem, State
from vision.fit.solve import LAST_SCALE, solve
from vision.geometry.centreline import Curves
from vision.geometry.contact import BarAxis
from vision.geometry.reasons import NO_REASON, Reason, joined
from vision.geometry.refusals import Refused
from vision.geometry.sampling import spread
from vision.touched.search import CLEARER, SeenBar, find_bars_as_clear_as, with_lines
from vision.touched.search_scene import SearchScene
from vision.truth.kept_fit import KeptFit
from vision.truth.line_source import EarlierWhisk
from vision.truth.place_comparison import FRAMES, PlaceComparison
from vision.truth.traced_lines import blurs_px
from vision.truth.whisk_fit import fit_whisk
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures

# [1] Of the bar's width, all cameras together: so much more must have changed under another place.
# True places gain 0.06 at most (by the blur of a bright side), false ones 0.02 to 0.3. Study:
# last_question.py.
_LEAST_GAIN = 0.02
# [sigmas] By which the best of all places exceeds the drawn one where the whisk is fitted again.
# Study: last_question.py.
_SURE_SIGMAS = 2.5
# [sigmas] By which one of two fits exceeds the other. Study: last_question.py.
_LIKELY_SIGMAS = 2.0
# [px] Places that are nearer to each other in all cameras are one, a lens blur or two; true fits end
# within 1.4 px of where they began, others 2.9 to 8 px away. Study: last_question.py.
_APART_PX = 2.0
# [rad] Bars nearer to each other in direction are one where the pictures cannot tell: a slope known
# worse than this is no truth. Stated.
_APART_RAD = np.radians(20.0)
# [fits] From other places, at most; more than one are needed where the first ends on the way. Stated.
_MOST_FITS = 3


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fit that explains the pictures of a whisk best. warning: another place that might, too."""

    whisk: WhiskPictures
    fitted: FittedWhisk
    warning: Reason = NO_REASON

    @property
    def axis(self) -> BarAxis:
        """Return the axis of the fitted bar, its point opposite the first contact."""
        axis = self.fitted.axis.upward()
        contact = np.array([self.fitted.measured.whisk[name] for name in ("x", "y", "z")])
        along_mm = (contact - axis.point_mm) @ axis.direction
        return BarAxis(axis.point_mm + along_mm * axis.direction, axis.direction)

    @property
    def as_earlier(self) -> EarlierWhisk:
        """Return what the next whisk of the trial begins from."""
        fitted = self.fitted
        reader = None if fitted.lines is None else fitted.lines.reader
        blur_px = blurs_px(self.whisk)
        return EarlierWhisk(self.axis, fitted.rest_mm, blur_px, reader, fitted.stroke_bends)

    @property
    def kept(self) -> KeptFit | None:
        """Return what is kept of the fit; None of an object that is no straight bar, or does not stand."""
        whisk = self.whisk
        problem = self.fitted.problem
        if not isinstance(problem.axis, BarAxis) or problem.motion is not None:
            return None
        return KeptFit(
            number=whisk.number,
            cameras=tuple(whisk.cameras.names),
            indices=tuple(whisk.indices),
            frames=tuple(self.fitted.frames),
            point_mm=problem.axis.point_mm,
            direction=problem.axis.direction,
            vector=self.fitted.state.vector,
            arcs_mm=self.fitted.state.arcs_mm,
            touching=problem.touching,
            bent=problem.bent,
            seen=tuple(problem.seen),
            onset=problem.onset,
            neighbour_correlation=tuple(problem.neighbour_correlation),
            light=dict(whisk.light),
            left_out=joined(*whisk.left_out),
            warning=self.warning,
        )

    @cached_property
    def place_comparison(self) -> PlaceComparison:
        """Return the comparison of this fit's place with others."""
        curves = self.fitted.some_curves(FRAMES)
        return PlaceComparison(self.whisk.views, curves, self.axis, self.whisk.rods)

    @cached_property
    def scene(self) -> SearchScene:
        """Return what the bar is searched in."""
        whisk = self.whisk
        return SearchScene(whisk.views, whisk.cameras, whisk.rods, whisk.motor_rad, whisk.settings)

    @cached_property
    def detection_score(self) -> float:
        """Return how clearly the cameras see a bar about the fitted axis, as the search scores it."""
        return with_lines(self.scene, SeenBar(self.axis, {})).detection_score

    def without_rivals(self) -> Self:
        """Return the fit with a bar that no other one may be."""
        bar = replace(self.whisk.bar, rivals=())
        return replace(self, whisk=replace(self.whisk, bar=bar))

    def from_place(self, axis: BarAxis) -> Self:
        """Return the fit that begins from another place. Raises Refused where there is none."""
        begin = replace(self.whisk, bar=SeenBar(axis, {}), light={}, earlier=None)
        try:
            return Explanation(begin, fit_whisk(begin))
        except np.linalg.LinAlgError as error:
            raise Refused(str(error), code="fit_not_converged") from error


def fit_again(kept: KeptFit, whisk: WhiskPictures) -> Explanation:
    """Return the fit of the same lines by the cameras of a whisk. Fills whisk.light."""
    cameras = whisk.cameras.subset(kept.cameras)
    problem = Problem(
        cameras=cameras,
        rods=whisk.rods,
        axis=BarAxis(kept.point_mm, kept.direction),
        motor_rad=whisk.motor_rad[list(kept.frames)],
        touching=kept.touching,
        bent=kept.bent,
        seen=kept.observed(),
        onset=kept.onset,
        neighbour_correlation=kept.neighbour_correlation,
    )
    begin = State(kept.vector, kept.arcs_mm)
    state, _ = solve(problem, begin, scales=[LAST_SCALE] * 3)
    fitted = FittedWhisk(problem, state, list(kept.frames))
    whisk.light.update(kept.light)
    same = replace(
        whisk,
        indices=list(kept.indices),
        views=tuple(view for view in whisk.views if view.camera.name in kept.cameras),
        cameras=cameras,
        bar=SeenBar(fitted.axis.upward(), {}),
        left_out=(kept.left_out,) if kept.left_out else (),
    )
    return Explanation(same, fitted, kept.warning)


def explain(whisk: WhiskPictures) -> Explanation:
    """Fit a whisk, and again from a place that explains its pictures better, if there is one.

    Fills whisk.light with how each camera sees the wire. Raises Refused where there is no touch to
    fit, or two places explain the pictures equally well.
    """
    best = best_explanation(Explanation(whisk, fit_whisk(whisk)))
    if whisk.motion is not None:  # its mean picture has no score
        return best
    return _weigh_rivals(best, _rivals_of(best, whisk.bar))


def best_explanation(first: Explanation) -> Explanation:
    """Return a fit, or that from another place which explains the pictures better.

    Raises Refused where both explain them equally well.
    """
    best = first
    for _ in range(_MOST_FITS):
        before = best
        best = _better(before)
        if best.fitted is before.fitted:
            break
    else:
        best = replace(best, warning=_unconverged_warning(best.place_comparison, best))
    return _in_place_of(first, best)


def _rivals_of(fit: Explanation, found: SeenBar) -> Sequence[BarAxis]:
    """Return the axes of bars that may be the one that is touched, besides that of a fit.

    found: by the search, with the bars that it does not exclude. A fit may leave what was found for a
    bar that is less clear, for a bar in one camera and its shadow in another are clear where their
    lines do not meet. All bars that are as clear as the fitted one are then its rivals. Where
    one camera alone saw the bar, a fit may end anywhere in its plane.
    """
    comparison = _comparison(fit)
    if len(found.seen_by) < 2 or not _are_apart(comparison, found.axis, fit.axis):
        return found.rivals
    if found.detection_score - fit.detection_score <= CLEARER:
        return found.rivals
    as_clear = find_bars_as_clear_as(fit.scene, fit.detection_score)
    # the whisk was fitted from what was found already
    return [axis for axis in as_clear if _are_apart(comparison, axis, found.axis)]


def _weigh_rivals(first: Explanation, rivals: Sequence[BarAxis]) -> Explanation:
    """Return the fit at the bar with the highest detection score, with a warning where another is hardly less clear.

    rivals: axes of bars that the search has not excluded. One of them counts where a whisk fits at it
    and changes as much of the pictures. A bar that is clearer than all has no rivals in the whisks to
    come. Raises Refused where scores are alike and the distances differ.
    """
    comparison = _comparison(first) if rivals else None
    explanations = [first, *_rival_explanations(first, rivals, comparison)]
    if len(explanations) == 1:
        return first.without_rivals()
    best, *others = sorted(explanations, key=lambda one: one.detection_score, reverse=True)
    as_clear = []
    for other in others:
        is_clearer = best.detection_score - other.detection_score >= CLEARER
        if not is_clearer and _are_apart(comparison, other.axis, best.axis):
            _require_one(best, other)
            as_clear.append(other)
    if not as_clear:
        return _in_place_of(first, best).without_rivals()
    warning = _rival_warning(comparison, as_clear[0].axis, best.axis)
    return _in_place_of(first, replace(best, warning=warning))


def _rival_explanations(
    first: Explanation, rivals: Sequence[BarAxis], comparison: PlaceComparison | None
) -> list[Explanation]:
    """Return the fits from rivals that end apart from the first one and change as much of the
    pictures."""
    explanations = []
    for axis in rivals:
        if not _are_apart(comparison, axis, first.axis):
            continue
        try:
            other = first.from_place(axis)
        except Refused:
            continue
        if not _are_apart(comparison, other.axis, first.axis):
            continue
        if comparison and _is_better(comparison, first.axis, other.axis, _LIKELY_SIGMAS):
            continue
        explanations.append(other)
    return explanations


def _are_apart(comparison: PlaceComparison | None, place: BarAxis, other: BarAxis) -> bool:
    """Return whether two places are not one: in some camera, or by their directions where the
    pictures cannot be compared."""
    if comparison is not None:
        return comparison.apart_px(place, other) > _APART_PX
    return place.angle_to(other) > _APART_RAD


def _rival_warning(comparison: PlaceComparison | None, place: BarAxis, drawn: BarAxis) -> Reason:
    """Return the warning that another place is as clear as that of a fit."""
    if comparison is not None:
        away = f"up to {comparison.apart_px(place, drawn):.0f} px away"
    else:
        away = f"turned by {np.degrees(place.angle_to(drawn)):.0f}°"
    sentence = f"the bar may be elsewhere: a place {away} explains the pictures as well"
    return Reason("bar_elsewhere", sentence)


def _in_place_of(first: Explanation, best: Explanation) -> Explanation:
    """Return the best fit as that of the first one's whisk, whose record of light it fills."""
    if best.fitted is first.fitted:
        return best
    light = first.whisk.light
    light.clear()
    light.update(best.whisk.light)
    return replace(best, whisk=replace(best.whisk, bar=SeenBar(best.axis, {}), light=light))


def compare_early(whisk: WhiskPictures, curves: Mapping[int, Curves]) -> PlaceComparison | None:
    """Return the comparison of places about the bar as a whisk's search has it; the best is found already.

    curves: by frame, of the wire, to a pixel or two. None where the pictures cannot decide.
    """
    if not _is_comparable(whisk):
        return None
    frames = list(curves)
    some_curves = {frame: curves[frame] for frame in spread(frames, FRAMES)}
    comparison = PlaceComparison(whisk.views, some_curves, whisk.bar.axis, whisk.rods)
    _ = comparison.best  # the costly part, kept
    return comparison


def unexplained(fit: Explanation, earlier: PlaceComparison | None) -> Reason:
    """Return why a fit may not be the truth, without another fit; no reason where nothing says so.

    Another place explains the pictures better, or the fit ended far from its beginning. earlier:
    the comparison about the fit's bar, of before the fit was known; None where there is none yet.
    """
    comparison = _comparison(fit, earlier)
    if comparison is None:
        return NO_REASON
    place = _better_place(comparison, fit)
    if place is not None:
        return _elsewhere_warning(comparison, place, fit.axis)
    return _unconverged_warning(comparison, fit)


def _is_comparable(whisk: WhiskPictures) -> bool:
    """Return whether the bar is straight, stands, and is seen before a known background."""
    is_straight = isinstance(whisk.bar.axis, BarAxis)
    is_known = all(np.any(view.background) for view in whisk.views)
    return is_straight and is_known and whisk.motion is None


def _comparison(fit: Explanation, earlier: PlaceComparison | None = None) -> PlaceComparison | None:
    """Return the comparison of a fit's place, an earlier one or a new one; None where the pictures
    cannot decide.

    They can where every camera sees the bar from a side: a fit that reads a bar where a camera sees
    none could be worse.
    """
    if not _is_comparable(fit.whisk):
        return None
    comparison = earlier or fit.place_comparison
    return comparison if len(comparison.bands) == len(fit.whisk.views) else None


def _better_place(comparison: PlaceComparison, fit: Explanation) -> BarAxis | None:
    """Return the place that surely explains the pictures better than a fit does; None without one."""
    place = comparison.best
    return place if _is_better(comparison, place, fit.axis, _SURE_SIGMAS) else None


def _better(fit: Explanation) -> Explanation:
    """Return the fit from a better place where that explains the pictures better, else this one.

    Raises Refused where both explain them equally well.
    """
    comparison = _comparison(fit)
    if comparison is None:
        return fit
    place = _better_place(comparison, fit)
    if place is not None:
        return _better_from(place, fit, comparison)
    if comparison.apart_px(fit.whisk.bar.axis, fit.axis) > _APART_PX:
        return _fit_again_from_end(fit, comparison)
    return fit


def _better_from(place: BarAxis, fit: Explanation, comparison: PlaceComparison) -> Explanation:
    """Return the fit from a better place, or this one with a warning.

    Raises Refused where both explain the pictures equally well.
    """
    try:
        other = fit.from_place(place)
    except Refused:
        return replace(fit, warning=_elsewhere_warning(comparison, place, fit.axis))
    if _is_better(comparison, other.axis, fit.axis, _LIKELY_SIGMAS):
        return other
    if _is_better(comparison, fit.axis, other.axis, _LIKELY_SIGMAS):
        return replace(fit, warning=_elsewhere_warning(comparison, place, fit.axis))
    if comparison.apart_px(other.axis, fit.axis) > _APART_PX:
        _require_one(fit, other)
    return fit


def _fit_again_from_end(fit: Explanation, comparison: PlaceComparison) -> Explanation:
    """Return the fit that begins where this one ended, far from its own beginning.

    Its lines are measured in windows about where they are expected, so that they may not have
    converged. A fit that explains less is not taken; this one has a warning then.
    """
    unconverged = replace(fit, warning=_unconverged_warning(comparison, fit))
    try:
        again = fit.from_place(fit.axis)
    except Refused:
        return unconverged
    is_worse = _is_better(comparison, fit.axis, again.axis, _LIKELY_SIGMAS)
    return unconverged if is_worse else again


def _is_better(comparison: PlaceComparison, place: BarAxis, other: BarAxis, sigmas: float) -> bool:
    """Return whether a place explains the pictures better than another one, and is not the same.

    sigmas: by which its gain must exceed chance.
    """
    gain, sigma = comparison.gain(place, other)
    is_sure = gain > max(_LEAST_GAIN, sigmas * sigma)
    return is_sure and comparison.apart_px(place, other) > _APART_PX


def _elsewhere_warning(comparison: PlaceComparison, place: BarAxis, drawn: BarAxis) -> Reason:
    """Return the warning that no fit was found at a place that explains the pictures better."""
    away_px = comparison.apart_px(place, drawn)
    return Reason(
        "bar_elsewhere",
        f"the bar may be elsewhere: a place up to {away_px:.0f} px away explains more of the "
        "pictures, and no whisk fits there",
    )


def _unconverged_warning(comparison: PlaceComparison, fit: Explanation) -> Reason:
    """Return the warning that a fit ended far from its beginning; no reason where it did not."""
    moved_px = comparison.apart_px(fit.whisk.bar.axis, fit.axis)
    if moved_px <= _APART_PX:
        return NO_REASON
    return Reason(
        "bar_unconverged",
        f"the bar's place did not converge: the last fit moved it by {moved_px:.1f} px",
    )


def _require_one(one: Explanation, other: Explanation) -> None:
    """Raise Refused where two fits that explain the pictures equally well differ in distance."""
    d_x = one.fitted.of_whisk("d_x")
    other_d_x = other.fitted.of_whisk("d_x")
    apart_mm = abs(d_x.value - other_d_x.value)
    if apart_mm > max(d_x.sigma, other_d_x.sigma):
        raise Refused(
            f"two explanations: at {d_x.value:.2f} and at {other_d_x.value:.2f} mm the bar explains "
            f"the pictures equally well, {apart_mm:.2f} mm apart",
            code="two_explanations",
        )
