"""What a header and a row of units state: a remark in brackets is no unit, units that contradict are asked about."""

import pytest
from logger_files import MAPPING, log, table

from belt_sim.importing import read, understand

RUN = {"tension": "10 N/mm2", "yaw": "-0.73 mrad"}
L = log(length=10.0)


def proposal(folder, names, data, units=None, **mapping):
    lines = table(names, data).split("\n")
    (folder / "a.csv").write_text("\n".join([lines[0], *([",".join(units)] if units else []), *lines[1:]]))
    return understand(read([folder / "a.csv"]), MAPPING | {"all_runs": RUN} | mapping)


def of_edge(folder, name, unit="", **mapping):
    """The question about a column of an edge beside time and travel, and what it is."""
    units = ["s", "m", unit] if unit else None
    names = ["time", "travel", name] if unit else ["time [s]", "travel [m]", name]
    found = proposal(folder, names, [L.time, L.travel, L.y1], units, **mapping)
    return [q.problem.remedy for q in found.missing], found.columns[-1]


@pytest.mark.parametrize("name", ["Kante 4 (d)", "Kante 4 (h)", "Kante 4 (s)", "Kante 4 (N)", "Kante 4 [%]"])
def test_a_unit_that_no_edge_has_leaves_the_edge_and_is_asked_about(tmp_path, name):
    (question,), column = of_edge(tmp_path, name)
    assert (column.role, column.at, column.unit) == ("signal", "point_4", "")
    assert question.startswith(f"the file states {name.split()[-1][1:-1]} as the unit of {name}, which is no unit of l")


@pytest.mark.parametrize("remark", ["(d)", "(h)", "(s)", "(N)", "(1)", "(mrad)"])
@pytest.mark.parametrize("order", ["Kante 4 {} [mm]", "Kante 4 [mm] {}"])
def test_of_two_units_the_one_that_an_edge_has_counts(tmp_path, order, remark):
    questions, column = of_edge(tmp_path, order.format(remark))
    assert not questions
    assert (column.at, column.unit) == ("point_4", "mm")


@pytest.mark.parametrize(
    ("name", "unit", "stated"),
    [("Kante 4 (in) [mm]", "", "in and mm"), ("Kante 4 (M) [mm]", "", "m and mm"), ("Kante 4 [mm]", "cm", "mm and cm")],
)
def test_two_units_that_an_edge_may_have_are_asked_about(tmp_path, name, unit, stated):
    (question,), column = of_edge(tmp_path, name, unit)
    assert question.startswith(f"the file states {stated} as units of {name}; in which one are its numbers")
    assert column.unit == ""
    questions, column = of_edge(tmp_path, name, unit, columns={name: {"unit": "mm"}})
    assert not questions
    assert column.unit == "mm"


def test_a_column_whose_unit_does_not_fit_may_be_left_out(tmp_path):
    names, rows = ["time [s]", "travel [m]", "y1 [mm]", "Ventil Position [%]"], [L.time, L.travel, L.y1, L.y4]
    mapping = {}
    for question in proposal(tmp_path, names, rows).missing:
        question.put(mapping, "ignore")
    assert mapping == {"columns": {"Ventil Position [%]": {"role": "ignore"}}}
    assert proposal(tmp_path, names, rows, **mapping).missing == ()


def test_a_role_of_the_mapping_says_which_unit_counts(tmp_path):
    questions, column = of_edge(tmp_path, "Aufnehmer (d) [mm]", columns={"Aufnehmer (d) [mm]": {"at": "point_4"}})
    assert not questions
    assert column.unit == "mm"


def test_a_row_of_units_counts_before_a_remark_and_holds_none(tmp_path):
    questions, column = of_edge(tmp_path, "Kante 4 (d)", "mm")
    assert not questions
    assert column.unit == "mm"
    (question,), column = of_edge(tmp_path, "Kante 4 [mm]", "V")
    assert question.startswith("the file states V as the unit")


@pytest.mark.parametrize(("name", "unit"), [("yaw [%]", ""), ("yaw", "[-]"), ("yaw (d)", "")])
def test_a_yaw_stays_a_yaw_whatever_its_unit(tmp_path, name, unit):
    names = ["time", "travel", "y1", name] if unit else ["time [s]", "travel [m]", "y1 [mm]", name]
    units = ["s", "m", "mm", unit] if unit else None
    (question,) = proposal(tmp_path, names, [L.time, L.travel, L.y1, 0.0 * L.time], units).missing
    assert question.path == ("columns", name, "unit")
    assert "which is no unit of angle that is known" in question.text


@pytest.mark.parametrize("unit", ["[mm/h]", "(V)", "[%]"])
def test_the_unit_of_a_rate_that_is_not_known_is_asked_about(tmp_path, unit):
    name = f"rate1 {unit}"
    data = [["a", "b"], [10.0, 20.0], [0.04, 0.02], [0.1, 0.2]]
    noise = {name: {"white": "0.002 mm/m"}}
    (question,) = proposal(tmp_path, ["run", "tension [N/mm2]", "yaw [deg]", name], data, columns=noise).missing
    assert question.path == ("columns", name, "unit")
    assert question.text.startswith(f"the file states {unit[1:-1]} as the unit of {name}")


@pytest.mark.parametrize(
    ("name", "role", "at"),
    [
        ("Sensor 1 Kraft [kN]", "tension", ""),
        ("Winkel Umlenk oben [mm]", "signal", "point_1"),
        ("Aufnehmer 7 [MPa]", "tension", ""),
    ],
)
def test_of_roles_that_a_name_speaks_of_the_one_that_has_its_unit_counts(tmp_path, name, role, at):
    (tmp_path / "a.csv").write_text(table(["travel [m]", "y1 [mm]", name], [L.travel, L.y1, L.y4]))
    column = read([tmp_path / "a.csv"])[0].columns[2]
    assert (column.role, column.at) == (role, at)


def test_a_position_is_not_asked_for_its_sign(tmp_path):
    for name, asked in (("Position 4 [mm]", []), ("Kante 4 (positiv: links) [mm]", ["sign"])):
        found = proposal(tmp_path, ["travel [m]", name], [L.travel, L.y4]).missing
        assert [q.path[-1] for q in found] == asked
