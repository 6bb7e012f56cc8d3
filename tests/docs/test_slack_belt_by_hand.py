"""The verdict of slack_belt follows from the table that docs/diagnosis.md prints, with a pocket calculator."""

import json
import math
from pathlib import Path

ROOT = Path(__file__).parents[2]
DIGIT = 0.16  # nats: three columns of one decimal each


def printed() -> list[tuple[frozenset[str], list[float]]]:
    """Explanation -> gain, fit, cost, unknown, prior and log odds of every printed row."""
    text = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    lines = text.partition("## By hand: slack_belt")[2].partition("## Constants")[0].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")][2:]
    return [(frozenset(r[0].split(" + ")), [float(x.replace("−", "-")) for x in r[1:7]]) for r in rows]


def test_log_odds_are_the_sum_of_the_columns_and_the_largest_is_the_verdict():
    rows = printed()
    assert len(rows) >= 3
    for _, (gain, fit, cost, unknown, prior, odds) in rows:
        assert abs(0.5 * gain - fit) < DIGIT
        assert abs(fit - cost + unknown + prior - odds) < DIGIT
    odds = [row[-1] for _, row in rows]
    assert rows[odds.index(max(odds))][0] == {"sag_roll"}
    assert 1.0 / sum(math.exp(o - max(odds)) for o in odds) > 0.95


def test_the_printed_rows_are_those_of_the_golden_diagnosis():
    golden = json.loads((ROOT / "tests" / "golden" / "diagnoses.json").read_text(encoding="utf-8"))["slack_belt"]
    assert (golden["verdict"], [e["id"] for e in golden["effects"]]) == ("explained", ["sag_roll"])
    names = {
        frozenset([*e["effects"], *(["something unknown"] if e["unknown"] else [])]): e for e in golden["considered"]
    }
    for ids, (gain, *_, odds) in printed():
        found = names[frozenset() if ids == {"nothing is missing"} else ids]
        assert abs(found["gain"] - gain) < 1.0
        assert abs(found["log_posterior"] - odds) < 1.0
