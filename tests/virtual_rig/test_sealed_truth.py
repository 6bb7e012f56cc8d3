"""A sealed truth opens unchanged, and only unchanged."""

import base64
import json
import zlib

import numpy as np
import pytest

from belt_sim.campaign import read_campaign
from belt_sim.errors import BeltError
from belt_sim.virtual_rig import Plan, make_campaign, reveal, write_blind
from belt_sim.virtual_rig.make import HASH, SEALED_FILE

SHORT = Plan(length=5.0, spacing=0.5)


@pytest.fixture
def folder(tmp_path):
    write_blind(tmp_path / "c", *make_campaign(hidden=["taper"], seed=4, plan=SHORT))
    return tmp_path / "c"


def refused(folder) -> str:
    with pytest.raises(BeltError) as caught:
        reveal(folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_the_published_hash_opens_the_truth(tmp_path):
    sha256 = write_blind(tmp_path / "c", *make_campaign(hidden=["taper"], seed=4, plan=SHORT))
    truth = reveal(tmp_path / "c")
    assert truth.sha256() == sha256
    assert truth.effects == [{"id": "taper", "parameters": {"kappa_t": 2e-5}, "d": None}]
    assert truth == make_campaign(hidden=["taper"], seed=4, plan=SHORT)[1]


def test_the_campaign_folder_tells_nothing(folder):
    assert all(b"taper" not in path.read_bytes() for path in folder.iterdir())


def test_a_changed_truth_is_refused(folder):
    truth = json.loads(zlib.decompress(base64.b64decode((folder / SEALED_FILE).read_text())))
    truth["effects"][0]["id"] = "cant"
    packed = base64.b64encode(zlib.compress(json.dumps(truth).encode())).decode()
    (folder / SEALED_FILE).write_text(packed)
    assert "does not match" in refused(folder)


def test_a_changed_hash_is_refused(folder):
    (folder / HASH).write_text("0" * 64 + "\n")
    assert "does not match" in refused(folder)


@pytest.mark.parametrize("damage", ["", "not base64!", "aGVsbG8=", "é"])
def test_a_damaged_seal_is_one_line(folder, damage):
    (folder / SEALED_FILE).write_text(damage, encoding="utf-8")
    assert "made" in refused(folder) or "anew" in refused(folder)


def test_no_seal_is_one_line(folder):
    (folder / SEALED_FILE).unlink()
    assert "nothing to reveal" in refused(folder)


def test_the_same_seed_writes_the_same_folder(tmp_path):
    for name in ("a", "b"):
        write_blind(tmp_path / name, *make_campaign(hidden=["wobble"], seed=9, plan=SHORT))
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_another_seed_is_another_campaign(tmp_path):
    first, second = (make_campaign(seed=s, plan=SHORT)[0].runs[0].signals["y1"] for s in (1, 2))
    assert np.all(first != second)


def test_what_is_written_is_what_was_made(folder):
    made, _ = make_campaign(hidden=["taper"], seed=4, plan=SHORT)
    back = read_campaign(folder)
    for a, b in zip(made.runs, back.runs, strict=True):
        np.testing.assert_allclose(b.signals["y4"], a.signals["y4"], rtol=1e-13)


def test_last_digits_in_which_processors_differ_are_not_sealed():
    truths = []
    for more in (1.0, 1 + 1e-13):
        hidden = [{"id": "taper", "kappa_t": 2.123456789123e-5 * more}]
        truths.append(make_campaign(hidden=hidden, seed=4, plan=SHORT)[1])
    assert truths[0].sha256() == truths[1].sha256()
    assert truths[0].effects[0]["parameters"]["kappa_t"] == pytest.approx(2.123456789123e-5, rel=1e-8)
