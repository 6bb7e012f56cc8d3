"""A made-up diagnosis with every key that the report knows."""


def diagnosis() -> dict:
    """An explained slack belt: sag_roll, confusable with nothing, one cell a little worse."""
    names = ["sag_roll", "yaw_compliance", "tension_bias", "taper", "soft_cover", "cant", "slip"]
    gains = [5120.0, 212.0, 61.0, 14.0, 8.0, 3.1, 0.0]
    ranking = [
        {
            "id": name,
            "gain": gain,
            "threshold": 9.1,
            "held_out_rms_mm": 0.04 if gain > 1000 else 1.9 - gain / 500,
            "parameters": {"strength": {"value": 1.02 - 2e-4 * gain, "u": 0.03, "unit": "1"}},
            "plausible": name != "yaw_compliance",
            "selection_frequency": 0.97 if gain > 1000 else 0.01,
            "note": "outside of its plausible range" if name == "yaw_compliance" else "",
        }
        for name, gain in zip(names, gains, strict=True)
    ]
    ranking[3]["parameters"] = {"kappa_t": {"value": 2.0e-5, "u": 1e-6, "unit": "1/m"}}
    per_run = [
        {
            "run": f"r{k // 2 + 1:02d}",
            "signal": ("y1", "y4")[k % 2],
            "tension": (7.0, 10.0, 20.0)[k // 2 % 3],
            "yaw_deg": -0.042,
            "use": "held_out" if k // 2 == 2 else "fit",
            "before_mm": 2.9 / (1 + k),
            "after_mm": 0.035 if k != 5 else 0.61,
            "floor_mm": 0.03,
            "worse": k == 5,
        }
        for k in range(6)
    ]
    return {
        "schema": "belt-diagnosis/1",
        "base_model": "beam_th2",
        "campaign": {"title": "Slack belt <sample>", "sha256": "9f" * 32, "source": {"kind": "synthetic"}},
        "verdict": "explained",
        "effects": [
            {
                "id": "sag_roll",
                "parameters": {"strength": {"value": 1.02, "u": 0.03, "unit": "1"}},
                "probability": 0.97,
                "confusable_with": [],
            }
        ],
        "ranking": ranking,
        "error": {
            "fit": {"before_mm": 1.92, "after_mm": 0.033},
            "held_out": {"before_mm": 1.88, "after_mm": 0.041},
            "noise_floor_mm": 0.03,
        },
        "where": {
            "worst": {"run": "r01", "signal": "y1", "travel_m": [0, 10]},
            "sentence": "Worst at 7 N/mm², y1, travel 0 to 10 m: the model runs 2.1 mm ahead (E/u_val = 24).",
            "boundary_n_per_mm2": 23.0,
            "boundary_sentence": "beam_th2 is adequate above 23 N/mm².",
        },
        "confusables": [{"a": "yaw_offset_tail", "b": "sensor_gain", "sigma": 0.1}],
        "next_runs": [
            {
                "action": "opposite yaw at 10 N/mm²",
                "separates": ["yaw_offset_tail", "sensor_gain"],
                "sigma_before": 0.1,
                "sigma_after": 5.9,
            }
        ],
        "unknown": None,
        "provenance": {
            "versions": {"belt-sim": "0.1.0", "numpy": "2.4.0", "jax": "0.10.2"},
            "seed": 7,
            "command": "belt-sim diagnose campaign=models/campaigns/slack model=beam_th2",
            "commit": "81f869e",
            "data_sha256": "ab" * 32,
        },
        "noise": {"y1": {"white_mm": 0.021, "wander_mm": 0.05, "wander_length_m": 3.0, "repeats": ["r01", "r04"]}},
        "per_run": per_run,
    }


def unknown() -> dict:
    """The same campaign when no effect explains it."""
    card = {
        "parity": "odd",
        "tension_exponent": -1.4,
        "onset_m": 3.2,
        "wavelength_m": None,
        "nearest": "soft_cover",
        "why": "soft_cover cannot: it would act at all tensions alike.",
    }
    return {**diagnosis(), "verdict": "none_known", "effects": [], "unknown": card}
