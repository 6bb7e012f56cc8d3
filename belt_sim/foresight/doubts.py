"""What a campaign's runs leave open whatever they measure: no second tension, no opposite yaw, no repeat ..."""

import math
from collections import defaultdict
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy import stats

from belt_sim.campaign import Campaign, suspicions
from belt_sim.campaign.quality import check_repeats, records_of
from belt_sim.campaign.types import rig_of
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.plausibility import prior_sigma
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.next_run import Outlook
from belt_sim.diagnosis.readings.candidates import SLOWEST
from belt_sim.foresight.harm import harm_warnings
from belt_sim.foresight.sheet_evidence import sheet_evidence
from belt_sim.line.spans import Composition
from belt_sim.results.check import Doubt, Pair, Visible
from belt_sim.results.diagnosis import RESOLVED

NOISY = 2.0  # times the usual scatter
SPANS = 3.0  # a record shorter than so many spans shows the start of the movement only


def doubts(campaign: Campaign, model: Composition, *, planned: bool) -> tuple[Doubt, ...]:
    """Slips in the data and in the sheet first, then what the plan lacks."""
    found = []
    if not planned:
        slips = (*suspicions(campaign), *check_repeats(campaign))
        settled = any(s.severity == "stop" for s in slips)
        of_sheet = () if settled else sheet_evidence(campaign, model)
        for s in (*slips, *(e.suspicion for e in of_sheet)):
            found.append(Doubt(kind=s.kind, sentence=str(s), stops=s.severity == "stop"))
    found += [Doubt(kind="harm", sentence=s) for s in harm_warnings(campaign)]
    found += [Doubt(kind="noise", sentence=s) for s in noisy_runs(campaign)]
    return (*found, *(Doubt(kind="plan", sentence=s) for s in _missing_runs(campaign)), *_sheet(campaign))


def noisy_runs(campaign: Campaign) -> list[str]:
    """Runs in which a signal scatters far more than in the others."""
    levels: dict[str, dict[str, float]] = defaultdict(dict)
    for record in records_of(campaign):
        levels[record.sheet.name][record.run.name] = record.measured_noise
    found = []
    for signal, of_run in levels.items():
        usual = float(np.median([*of_run.values()]))
        noisy = [f"{run} ({level / usual:.2g} times)" for run, level in of_run.items() if level > NOISY * usual > 0.0]
        if noisy:
            found.append(
                f"{signal} scatters more in {', '.join(noisy)} than in the other runs; look at its sensor there"
            )
    return found


def _missing_runs(campaign: Campaign) -> list[str]:
    runs, found = campaign.runs, []
    tensions = {round(r.tension / 1e3) for r in runs}
    if len(tensions) < 2:
        found.append("there is one tension; a second one tells what belongs to the belt's stiffness or its sag")
    if not any(r.yaw > 0.0 for r in runs) or not any(r.yaw < 0.0 for r in runs):
        found.append("there is one sign of yaw; the other one tells what the machine does by itself from what yaw does")
    if not any(r.yaw == 0.0 and r.yaw_head == 0.0 for r in runs):
        found.append("there is no run at zero yaw; one shows what the machine does by itself, and the noise")
    if not any(r.repeat_of for r in runs):
        found.append("no run is repeated; noise is read off repeats, and is taken as stated without")
    if len({r.direction for r in runs}) < 2:
        found.append("there is one direction of travel; one reversed run tells offsets of a pulley from skewed rollers")
    curved = [r for r in runs if len(r.travel)]
    span = float(rig_of(campaign).span_length)
    short = [r.name for r in curved if r.travel[-1] - r.yaw_at < SPANS * span]
    if curved and len(short) == len(curved):
        found.append(f"no record reaches {SPANS:g} spans ({SPANS * span:.0f} m): late drift is hardly in it")
    if curved and len(campaign.signals) < 2:
        found.append(
            "there is one signal; a second point, at the other pulley, tells drift from a belt that stands askew"
        )
    return found


def _sheet(campaign: Campaign) -> list[Doubt]:
    """What the sheet states as perfect that no instrument is."""
    perfect = [s.name for s in campaign.signals if s.zero == 0.0]
    found = []
    if perfect and campaign.source.kind != "synthetic":
        sentence = f"zero of {', '.join(perfect)} is not stated and counts as perfect; state how well y = 0 is known"
        found.append(Doubt(kind="sheet", sentence=sentence))
    if campaign.source.kind != "synthetic" and campaign.settings.yaw_u == 0.0:
        found.append(Doubt(kind="sheet", sentence="settings.yaw is not stated: every yaw counts as exact"))
    return found


# The smallest size of an effect that the readings would show: seen nine times in ten, named by chance in one of twenty
# campaigns.


FALSE_ALARM, MISSED = 0.05, 0.1
NOTHING = 1e-9  # whitened size of a column that is not there


def visible(bench: Workbench, fit: Fit) -> list[Visible]:
    """Every effect by the parameter that shows best, those that show best first."""
    chance = stats.chi2.isf(FALSE_ALARM / max(len(bench.forward.classes), 1), 1)  # of all candidates together
    least = math.sqrt(float(chance)) + float(stats.norm.isf(MISSED))  # whitened size that shows
    found = []
    for cls in bench.forward.classes:
        best, strength = _best_column(bench, fit, cls.id)
        slot = bench.forward.slots[best]
        most, share = prior_sigma(bench.forward, [best])[0] * slot.scale, least / strength if strength else math.inf
        found.append(
            Visible(
                effect=cls.id,
                parameter=slot.name,
                unit=slot.parameter.unit,
                meaning=slot.parameter.meaning,
                smallest=share * most if strength else None,
                largest_plausible=most,
                share=share,
            )
        )
    return sorted(found, key=lambda v: v.share)


def _best_column(bench: Workbench, fit: Fit, name: str) -> tuple[int, float]:
    """Position of the parameter of an effect that shows best, and its whitened size at the largest that a machine could
    have; 0 where nothing shows.
    """
    own = bench.forward.index(name)
    length = np.linalg.norm(fit.columns[own], axis=1)
    sized = np.array([not bench.forward.slots[k].only_shapes for k in own])
    strength = np.where(sized & (length > NOTHING), length * prior_sigma(bench.forward, own), 0.0)
    return own[int(np.argmax(strength))], float(np.max(strength))


#: Size at which a pair is judged, in whitened units: an effect that is plain to see.
PLAIN = 12.0


def pairs(bench: Workbench, fit: Fit, seen: list[Visible], *, advise: bool) -> list[Pair]:
    """Pairs of visible effects: the one, at PLAIN, leaves less than RESOLVED when the other is fitted in its place."""
    names = [v.effect for v in seen if v.share < 1.0]
    alike = [(_separation(bench, fit, a, b), a, b) for a, b in combinations(names, 2)]
    alike = sorted(pair for pair in alike if pair[0] < RESOLVED)
    advice = _advice(bench, fit, [(a, b) for _, a, b in alike]) if advise and alike else {}
    return [Pair(effects=(a, b), sigma=sigma, **advice.get((a, b), {})) for sigma, a, b in alike]


def _separation(bench: Workbench, fit: Fit, a: str, b: str, columns: np.ndarray | None = None) -> float:
    """Sigmas by which one at PLAIN differs from the other fitted in its place, whichever is less; columns (k, m): those
    of the fit, and of a further run."""
    columns = fit.columns if columns is None else columns
    left = []
    for own, other in ((a, b), (b, a)):
        best, _ = _best_column(bench, fit, own)
        span = columns[bench.forward.index(other)]
        span = span[np.linalg.norm(span, axis=1) > NOTHING * np.linalg.norm(span)]
        target = PLAIN / np.linalg.norm(fit.columns[best]) * columns[best]
        fitted = np.linalg.lstsq(span.T, target, rcond=1e-9)[0] if len(span) else np.zeros(0)
        left.append(float(np.linalg.norm(target - fitted @ span)))
    return min(left)


def _advice(bench: Workbench, fit: Fit, alike: list[tuple[str, str]]) -> dict[tuple[str, str], dict[str, Any]]:
    """The action of the menu that tells each pair apart best, and the sigma after it; none of pairs with SLOWEST
    effects, as a second compilation for each of them would take longer than all else."""
    light = [k for k, s in enumerate(bench.forward.slots) if s.effect.id not in SLOWEST]
    outlook = Outlook(bench, replace(fit, free=light, columns=fit.columns[light], slopes=fit.slopes[light]))
    further = np.zeros((len(outlook.actions), len(fit.free), outlook.forward.samples.y[0].size))
    further[:, light] = outlook.white(outlook.predict(fit, light)[1]).swapaxes(0, 1)
    found = {}
    for a, b in alike:
        if not SLOWEST & {a, b}:
            after = [_separation(bench, fit, a, b, np.concatenate([fit.columns, f], axis=1)) for f in further]
            found[a, b] = {"action": outlook.actions[int(np.argmax(after))].words, "sigma_after": max(after)}
    return found
