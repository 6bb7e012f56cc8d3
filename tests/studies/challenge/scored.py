"""Truths and answers put together by hand: results of campaigns that nobody drew."""

from studies.challenge.score import ScoredCase, score_case

DIRT = {"kind": "dropout", "signal": "y1", "run": "r02"}


def truth(kind: str, *names: str, d: float = 12.0, **more):
    effects = [{"id": n, "parameters": {"a": 2.0, "b": 0.0}, "d": d} for n in names]
    base = {"kind": kind, "base": "strip", "effects": effects, "lookalikes": [], "distance": None, "dirty": None}
    return base | more


def result(hidden, answer, **more):
    common = {"seed": 7, "source": "mix", "ablation": "diagnosis", "bootstraps": 100, "commit": "abc"}
    return common | {"seconds": {"answer": 3.0}, "truth": hidden, "answer": answer} | more


def facts(hidden, answer) -> ScoredCase:
    return score_case(result(hidden, answer))
