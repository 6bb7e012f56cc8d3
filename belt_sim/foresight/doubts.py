"""What a campaign's runs leave open whatever they measure: no second tension, no opposite yaw, no repeat ..."""

import math
from collections import defaultdict
from dataclasses import replace
from itertools import combinations

import numpy as np
from scipy import stats

from belt_sim.analytic.composition import Composition
from belt_sim.campaign import Campaign, suspicions
from belt_sim.campaign.quality.kinematics import span_of
from belt_sim.campaign.quality.record import records_of
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.next_run import Outlook
from belt_sim.diagnosis.readings.candidates import SLOWEST
from belt_sim.foresight.harm import harm_warnings
from belt_sim.foresight.sheet_evidence import sheet_suspicions
from belt_sim.results.check import Doubt, Pair, Visible
from belt_sim.results.findings import RESOLVED

NOISY = 2.0  # times the usual scatter
SPANS = 3.0  # a record shorter than so many spans shows the start of the movement only


def doubts(campaign: Campaign, model: Composition, *, planned: bool) -> tuple[Doubt, ...]:
    """Slips in the data and in the sheet first, then what the plan lacks."""
    found = []
    if not planned:
        slips = suspicions(campaign)
        for s in (*slips, *sheet_suspicions(campaign, model, slips)):
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
    span = span_of(campaign)
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


def detectable_size(candidates: int) -> float:
    """Whitened size that shows: chance of all ``candidates`` together, and luck, allowed for."""
    chance = math.sqrt(float(stats.chi2.isf(FALSE_ALARM / max(candidates, 1), 1)))
    return chance + float(stats.norm.isf(MISSED))


def visible(bench: Workbench, fit: Fit) -> list[Visible]:
    """Every effect by the parameter that shows best, those that show best first."""
    least = detectable_size(len(bench.forward.classes))
    found = [_visible(bench, fit, cls.id, least) for cls in bench.forward.classes]
    return sorted(found, key=lambda v: v.share)


def best_column(bench: Workbench, fit: Fit, name: str) -> int:
    """Position of the parameter of an effect that shows best, for what a machine could have of it."""
    return min(bench.forward.index(name), key=lambda k: _share(bench, fit, k, 1.0))


def reach(bench: Workbench, position: int) -> float:
    """The largest plausible size of a parameter, in units of its scale, about null."""
    slot = bench.forward.slots[position]
    declared = slot.parameter
    return max(abs(bound - declared.null) for bound in declared.plausible) / slot.scale


def _share(bench: Workbench, fit: Fit, position: int, least: float) -> float:
    """Smallest visible size over the largest that a machine could have; infinite where nothing shows."""
    slot = bench.forward.slots[position]
    length = float(np.linalg.norm(fit.columns[position]))
    if slot.only_shapes or length < 1e-9 * least:
        return math.inf
    return least / (length * reach(bench, position))


def _visible(bench: Workbench, fit: Fit, name: str, least: float) -> Visible:
    best = best_column(bench, fit, name)
    slot = bench.forward.slots[best]
    declared, share = slot.parameter, _share(bench, fit, best, least)
    most = reach(bench, best) * slot.scale
    return Visible(
        effect=name,
        parameter=slot.name,
        unit=declared.unit,
        meaning=declared.meaning,
        smallest=share * most if math.isfinite(share) else None,
        largest_plausible=most,
        share=share,
    )


#: Size at which a pair is judged, in whitened units: an effect that is plain to see.
PLAIN = 12.0


def pairs(bench: Workbench, fit: Fit, seen: list[Visible], *, advise: bool) -> list[Pair]:
    """Pairs of visible effects: the one, at PLAIN, leaves less than RESOLVED when the other is fitted in its place."""
    names = [v.effect for v in seen if v.share < 1.0]
    outlook = _further(bench, fit) if advise and names else None
    alike = []
    for a, b in combinations(names, 2):
        sigma = _separation(bench, fit, a, b)
        if sigma < RESOLVED:
            alike.append((sigma, a, b))
    found = []
    for sigma, a, b in sorted(alike):
        action, after = _best(bench, fit, outlook, a, b) if outlook else ("", 0.0)
        found.append(Pair(effects=(a, b), sigma=sigma, action=action, sigma_after=after))
    return found


def _separation(bench: Workbench, fit: Fit, a: str, b: str, extra: np.ndarray | None = None) -> float:
    """Sigmas by which one at PLAIN differs from the other fitted in its place, whichever is less; extra (k, m): columns
    of a further run."""
    columns = fit.columns if extra is None else np.concatenate([fit.columns, extra], axis=1)
    left = []
    for own, other in ((a, b), (b, a)):
        best = best_column(bench, fit, own)
        size = PLAIN / np.linalg.norm(fit.columns[best])
        span = columns[bench.forward.index(other)]
        span = span[np.linalg.norm(span, axis=1) > 1e-9 * np.linalg.norm(span)]
        target = size * columns[best]
        fitted = np.linalg.lstsq(span.T, target, rcond=1e-9)[0] if len(span) else np.zeros(0)
        left.append(float(np.linalg.norm(target - fitted @ span)))
    return min(left)


def _further(bench: Workbench, fit: Fit) -> tuple[list[str], np.ndarray]:
    """Words of every action of the menu, and the whitened columns of its run (k, actions, m); SLOWEST effects are
    left out, a second compilation for each of them would take longer than all else."""
    light = [k for k, s in enumerate(bench.forward.slots) if s.effect.id not in SLOWEST]
    outlook = Outlook(bench, replace(fit, free=light, columns=fit.columns[light], slopes=fit.slopes[light]))
    slopes = outlook.white(outlook.predict(fit, light)[1])
    columns = np.full((len(fit.free), *slopes.shape[1:]), np.nan)
    columns[light] = slopes
    return [a.words for a in outlook.actions], columns


def _best(bench: Workbench, fit: Fit, further: tuple[list[str], np.ndarray], a: str, b: str) -> tuple[str, float]:
    words, columns = further
    rows = [*bench.forward.index(a), *bench.forward.index(b)]
    if np.isnan(columns[rows]).any():
        return "", 0.0
    after = [_separation(bench, fit, a, b, columns[:, k]) for k in range(len(words))]
    best = int(np.argmax(after))
    return words[best], after[best]
