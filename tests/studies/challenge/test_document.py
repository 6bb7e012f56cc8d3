"""What is published of challenges: files of facts that read back, and the document made of them."""

from scored import result, truth
from small_challenge import answer_of

from studies.challenge.report import publish as publish_into
from studies.challenge.report import read_stored
from studies.challenge.score import score_case


def publish(results, top, drawn=()):
    return publish_into(results, top, top / "challenge", drawn)


def test_what_is_published_reads_back_and_tells_failures_with_reasons(tmp_path):
    ranking = [{"id": "taper", "gain": 5.0, "threshold": 9.0, "note": "not needed"}]
    good = result(truth("library", "taper"), answer_of("taper"))
    missed = result(truth("library", "taper"), answer_of() | {"ranking": ranking})
    path = publish([good, missed], tmp_path)
    (back,) = read_stored(tmp_path / "challenge")
    assert back.cases == [score_case(good), score_case(missed)]
    text = path.read_text()
    assert "| right effect first, d = 12 | >= 98% | 1 of 2 |" in text
    assert "taper: gain 5.0 under its threshold 9.0" in text
    assert len(list((tmp_path / "images").iterdir())) == 1
    assert publish([], tmp_path).read_text() == text


def test_campaigns_of_the_3d_belt_stand_under_a_heading_of_their_own(tmp_path):
    publish([result(truth("library", "taper"), answer_of("taper"))], tmp_path)
    answers = ((40, answer_of()), (41, answer_of("cant")))
    space = [result(truth("nothing"), answer) | {"source": "space", "seed": s} for s, answer in answers]
    above, below = publish(space, tmp_path).read_text().split("## Campaigns of the 3D belt")
    assert "first_seed=40" not in above
    assert "first_seed=40 count=2" in below
    assert "| false alarm when nothing is hidden | <= 5% | 1 of 2 | 9% - 91% |" in below
    assert "| 41 | space | nothing: nothing | explained cant | wrong | cant at probability 1.00 |" in below


def test_results_in_any_order_are_one_file_and_what_has_no_answer_is_told(tmp_path):
    answered = [result(truth("nothing"), answer_of()) | {"seed": s} for s in (9, 3, 5, 4)]
    text = publish(answered, tmp_path, drawn=range(3, 13)).read_text()
    assert "first_seed=3 count=10 bootstraps=100    # 4 of 10 answered" in text
    assert "in no figure: 6 of mix (6-8, 10-12)" in text
    (back,) = read_stored(tmp_path / "challenge")
    assert [f.seed for f in back.cases] == [3, 4, 5, 9]
    whole = publish([answered[1], answered[3], answered[2]], tmp_path).read_text()  # takes the place of the other
    assert "first_seed=3 count=3 bootstraps=100    # 3 campaigns" in whole
    assert "in no figure" not in whole


def test_campaigns_of_another_first_seed_stand_beside_those_that_were_published(tmp_path):
    publish([result(truth("nothing"), answer_of()) | {"seed": s} for s in (3, 4)], tmp_path)
    later = [result(truth("nothing"), answer_of("cant")) | {"seed": 70, "commit": "b" * 40}]
    text = publish(later, tmp_path).read_text()
    assert "| false alarm when nothing is hidden | <= 5% | 1 of 3 |" in text
    assert f"first_seed=70 count=1 bootstraps=100    # 1 campaigns; commit {'b' * 10}" in text


def test_failures_stand_below_their_cause(tmp_path):
    ranking = [{"id": "taper", "gain": 99.0, "threshold": 9.0, "plausible": False, "note": "implausible value"}]
    unnamed = answer_of(verdict="none_known") | {"ranking": ranking}
    hidden = truth("library", "taper")
    answers = [unnamed, unnamed, answer_of(), answer_of("cant"), answer_of("taper")]
    text = publish([result(hidden, a) | {"seed": s} for s, a in enumerate(answers)], tmp_path).read_text()
    assert "4 of 5; an effect below" in text
    cause = "one hidden: flagged as unknown, not named; its value is taken for implausible"
    assert f"| {cause} | 2 | taper 2 |" in text
    assert f"<summary>{cause}: 2</summary>" in text
    assert "| one hidden: overlooked | 1 | taper |" in text
    assert "| one hidden: another named | 1 | taper |" in text


def test_two_effects_are_told_by_what_one_effect_leaves_of_them(tmp_path):
    hidden = [truth("two", "taper", "crown") | {"distance": d} for d in (2.9, 3.1, 8.0, 40.0)]
    answers = [answer_of("taper"), answer_of("taper", "crown"), answer_of("cant", "crown"), answer_of("taper", "crown")]
    found = [result(h, a) | {"seed": s} for s, (h, a) in enumerate(zip(hidden, answers, strict=True))]
    text = publish(found, tmp_path).read_text()
    section = text.split("## Two hidden effects")[1].split("## ")[0]
    told = {cells[1]: [c.split(" (")[0] for c in cells[2:6]] for cells in _cells(section)}
    assert told["under 3"] == ["0 of 1", "0 of 1", "1 of 1", "0 of 1"]
    assert told["3 - 4.8"] == ["1 of 1", "1 of 1", "0 of 1", "0 of 1"]
    assert told["4.8 - 9"] == ["0 of 1", "0 of 1", "0 of 1", "1 of 1"]
    assert told["9 and more"] == ["1 of 1", "1 of 1", "0 of 1", "0 of 1"]


def _cells(section):
    return [[c.strip() for c in line.split("|")] for line in section.splitlines() if "|" in line]


def test_laws_beyond_the_library_are_told_by_distance_form_and_place(tmp_path):
    said = {"place": "yaw_head", "variable": "wave", "form": "periodic"}
    answers = [(7.0, answer_of(verdict="none_known")), (9.0, answer_of()), (15.0, answer_of(verdict="none_known"))]
    rows = [result(truth("outside", "beat", distance=d, **said), a) | {"seed": int(d)} for d, a in answers]
    text = publish(rows, tmp_path).read_text()
    assert "| under 8 | 1 | 1 of 1 (21 - 100 %) | 0 of 1 (0 - 79 %) |" in text
    assert "| 8 - 12 | 1 | 0 of 1 (0 - 79 %) |" in text
    assert "| periodic | 2 | 1 of 2 (9 - 91 %) |" in text
    assert "| periodic | wave | yaw_head | beat | 2 | 1 of 2 | 0 of 2 | 0 of 2 | 0 of 2 |  |" in text
