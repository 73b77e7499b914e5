"""All pictures of one identification, with what they show in words."""

from __future__ import annotations

import numpy as np

from shoal.pictures import titles
from shoal.pictures.answer import Answer
from shoal.pictures.choice import why
from shoal.pictures.convergence import convergence
from shoal.pictures.correlations import correlations, strongest
from shoal.pictures.drawn import Drawn
from shoal.pictures.ladder import ladder
from shoal.pictures.landscape import has_ellipse, landscape, survey
from shoal.pictures.motion import DrawnMotion, motion
from shoal.pictures.overlay import follows, overlay
from shoal.pictures.poses import poses
from shoal.pictures.posterior import posterior, says, shown
from shoal.pictures.prediction import prediction, told
from shoal.pictures.profiles import profiles
from shoal.pictures.residuals import residuals, white
from shoal.pictures.signals import gaps, signals
from shoal.pictures.waterfall import waterfall
from shoal.selection import select


def motions(answer: Answer) -> list[DrawnMotion]:
    """The motion of every recording."""
    return [motion(answer, name) for name in answer.estimate.measurement.recordings]


def gallery(answer: Answer, moving: list[DrawnMotion]) -> list[Drawn]:
    """Every picture that this identification has something to show in."""
    estimate = answer.estimate
    drawn = [_overlay(answer), *(_poses(answer, one) for one in moving[:1]), _residuals(answer)]
    if estimate.prediction:
        drawn.append(_prediction(answer))
    if len(estimate.history[0]) > 1:
        drawn.append(_convergence(answer))
    if estimate.minima:
        values = ", ".join(f"{other['fitness']:.3g}" for other in estimate.minima)
        alt = f"Fitness of the answer, {estimate.fitness:.3g}, and where other searches ended: {values}."
        caption = "Each point is a place where a local search ended; far apart is good, side by side is ambiguous."
        drawn.append(Drawn("waterfall", waterfall(estimate), alt, caption))
    if estimate.profiles:
        alt = f"Profile of the misfit over each of {', '.join(estimate.profiles)}."
        caption = (
            "The interval ends where the profile crosses the dashed line; the dotted parabola is its approximation."
        )
        drawn.append(Drawn("profiles", profiles(estimate, answer.problem), alt, caption))
    if estimate.posterior is not None:
        alt = f"Draws of {', '.join(shown(estimate.posterior))}, each by itself and every two. {says(estimate)}."
        caption = (
            "Where draws and intervals end at the same places, the intervals tell all. A bent or a long cloud is what "
            "they cannot tell."
        )
        drawn.append(Drawn("posterior", posterior(estimate, answer.problem), alt, caption))
    if len(answer.names) > 1 and np.all(np.isfinite(answer.point)):
        drawn += _around(answer)
    if estimate.model.get("selection"):
        drawn.append(model_choice(answer))
    return drawn


def model_choice(answer: Answer) -> Drawn:
    """The models that were open, tried once more at the answer, over the longest recording."""
    recordings = answer.estimate.measurement.recordings
    name = max(recordings, key=lambda one: recordings[one].times[-1])
    view, stage = answer.view(name), answer.estimate.model["selection"][-1]
    times = view["clock"] * recordings[name].times + view["delay"]
    found = select(answer.estimate.scenes[name], stage["tolerance"], np.maximum(times, 0.0))
    alt = f"Estimated error over the cost of a run for {len(found.candidates)} models; {found.chosen.name} is taken."
    caption = f"Models tried at the answer; it was found with {stage['model']}. {' '.join(why(found))}"
    return Drawn("ladder", ladder(found), alt, caption)


def _around(answer: Answer) -> list[Drawn]:
    """Draw the pictures that need runs around the answer."""
    pair = strongest(answer)
    one, other = (answer.names[k] for k in pair)
    drawn = []
    for zoom in (False, True):
        name = "landscape-zoom" if zoom else "landscape"
        alt = f"Contours of the fitness over {one} and {other}, {'around the answer' if zoom else 'in the whole box'}."
        ellipse = (
            " The ellipse holds 95 % of what noise alone does, other parameters fixed."
            if zoom and has_ellipse(answer)
            else ""
        )
        caption = f"Dark is a good fit.{ellipse}"
        drawn.append(Drawn(name, landscape(answer, survey(answer, pair, zoom=zoom)), alt, caption))
    value = answer.correlation[pair]
    alt = f"Table of correlations of {', '.join(answer.names)}; the largest is {value:+.3f}, of {one} and {other}."
    caption = "Parameters with a correlation near +1 or −1 are known only together."
    return [*drawn, Drawn("correlations", correlations(answer), alt, caption)]


def _overlay(answer: Answer) -> Drawn:
    figure = overlay(answer.estimate)
    alt = f"Measured values as circles with the fitted model as a line. Overall, {follows(answer.estimate)}."
    what = "fitted" if answer.estimate.prediction else "measured"
    grey = f" Where nothing was {what} it is grey." if any(gaps(one) for one in signals(answer.estimate)) else ""
    return Drawn("overlay", figure, alt, f"The fitted model (red-orange) over the data.{grey}")


def _poses(answer: Answer, found: DrawnMotion) -> Drawn:
    what = "identified" if answer.estimate.verdict.trusted else "fitted"
    title = titles.ends(f"{answer.problem.name}, {what}", found)
    alt = f"The bodies {', '.join(found.outlines)} at several instants, later ones darker, over the measured places."
    lines = ", orange lines measured directions" if found.directions else ""
    return Drawn("poses", poses(found, title), alt, f"The later, the darker; black circles are measured places{lines}.")


def _convergence(answer: Answer) -> Drawn:
    estimate = answer.estimate
    figure = convergence({estimate.method: estimate}, titles.pays(estimate.problem, {estimate.method: estimate}))
    alt = f"Best fitness against counted evaluations, both axes logarithmic; it ends at {estimate.fitness:.3g}."
    return Drawn("convergence", figure, alt, "What the search paid for what it found; the marker is its end.")


def _prediction(answer: Answer) -> Drawn:
    figure = prediction(answer.estimate)
    alt = f"Samples that were not fitted, with the prediction, and its error. Here {told(answer.estimate)}."
    caption = "What was held out of the fit. The band is what the estimate states; 95 % of the points should lie in it."
    return Drawn("prediction", figure, alt, caption)


def _residuals(answer: Answer) -> Drawn:
    figure = residuals(answer.estimate)
    alt = f"Residuals against time and their autocorrelation; {white(answer.estimate)}."
    caption = "Noise stays in the orange bands: 95 % of the points should. A wave is something the model lacks."
    return Drawn("residuals", figure, alt, caption)
