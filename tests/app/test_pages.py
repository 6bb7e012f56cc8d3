"""The pages in a real browser: sliders move curves, dropped campaigns are compared and diagnosed, errors are lines."""

import io
import json
import zipfile

import pytest

import belt_sim as bs
from belt_sim.app.session import MAX_UPLOAD
from belt_sim.results.files import file_json

CURVE = "document.querySelector('[data-name=curves] svg')?.outerHTML"
NOTED = 2000  # [ms] until the server has heard of what was written, on a busy machine
DRAWN = "[data-name={}] svg path"


def simulate_page(page, served) -> str:
    """The page of sliders, with its first curve."""
    page.goto(served.address)
    return curve_other_than(page, None)


def curve_other_than(page, before) -> str:
    page.wait_for_function(f"before => {CURVE} && JSON.stringify({CURVE}) !== JSON.stringify(before)", arg=before)
    return page.evaluate(CURVE)


def drop(page, *paths) -> None:
    """Drop files, and wait until the page has taken them in."""
    before = page.locator("[data-version]").get_attribute("data-version")
    page.locator("input[type=file]").set_input_files([str(p) for p in paths])
    page.locator(f"[data-version]:not([data-version='{before}'])").wait_for(state="attached")


def alerts(page) -> list[str]:
    """Lines of the alerts, once there is one."""
    page.get_by_role("alert").first.wait_for()
    return page.get_by_role("alert").all_inner_texts()


@pytest.fixture
def measurements(page, served):
    """The page of measurements."""
    page.goto(f"{served.address}/measurements")
    page.locator("input[type=file]").wait_for(state="attached")
    return page


def test_sliders_change_the_curve(page, served):
    curve = simulate_page(page, served)
    facts = page.locator("[data-name=facts]")
    before = facts.inner_text()
    for name, key in (("tension", "ArrowRight"), ("yaw", "ArrowLeft"), ("travel", "ArrowRight")):
        page.locator(f"[data-name=slider-{name}] [tabindex]").focus()
        for _ in range(4):
            page.keyboard.press(key)
        curve = curve_other_than(page, curve)
    assert facts.inner_text() != before
    page.get_by_text("Not settled: these are slopes").wait_for()
    page.get_by_text("Model strip_lift_off, as the belt").wait_for()
    page.locator("[data-name=model]").click()
    page.get_by_role("option", name="beam_th2").click()
    page.get_by_label("tension number").fill("2")
    page.get_by_label("yaw number").fill("0.2")
    page.get_by_text("edge goes slack").wait_for()
    page.get_by_text("the spans sag and tilt: use strip").wait_for()


def test_nothing_is_wider_than_a_telephone_and_its_night_is_dark(browser, served):
    tab = browser.new_page(viewport={"width": 390, "height": 900}, color_scheme="dark")
    tab.goto(f"{served.address}/?token={served.token}")
    tab.wait_for_selector(DRAWN.format("curves"), state="attached")
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    assert tab.evaluate("document.body.classList.contains('body--dark')")
    tab.close()


def test_a_campaign_that_is_dropped_is_shown_and_compared(measurements, small, tmp_path):
    archive = tmp_path / "mine.zip"
    with zipfile.ZipFile(archive, "w") as made:
        for file in small.iterdir():
            made.write(file, f"mine/{file.name}")
    drop(measurements, archive)
    measurements.get_by_text("step: 4 runs").wait_for()
    measurements.wait_for_selector(DRAWN.format("measured"), state="attached")
    measurements.get_by_role("button", name="Compare").click()
    measurements.locator("[data-name=overlay] img").wait_for()
    assert measurements.locator(".printed").inner_text().count(" r05 ") == 2
    with measurements.expect_download() as got:
        measurements.get_by_text("Download everything").click()
    names = zipfile.ZipFile(io.BytesIO(got.value.path().read_bytes())).namelist()
    assert {"comparison.json", "overlay.svg"} <= {n.split("/")[-1] for n in names}


def test_a_small_diagnosis_runs_to_its_report_and_says_what_python_says(measurements, small, served):
    drop(measurements, *small.iterdir())
    measurements.get_by_text("step: 4 runs").wait_for()
    measurements.get_by_text("More about the diagnosis").click()
    measurements.locator("[data-name=find]").fill("conical")
    measurements.get_by_text("Camber: a belt").wait_for(state="hidden")
    measurements.get_by_text("Taper: a pulley that is a cone").click()
    measurements.locator("label", has_text="model").first.click()
    measurements.get_by_role("option", name="strip: hanging").click()
    measurements.get_by_role("button", name="Diagnose").click()
    measurements.locator("[data-name=stage]").wait_for()
    measurements.get_by_role("link", name="Simulate").click()  # the page stays alive while it goes on
    curve_other_than(measurements, None)
    measurements.go_back()
    frame = measurements.frame_locator("iframe[title=report]")
    frame.locator("h1").wait_for(timeout=180_000)
    frame.locator("#overlays svg.shown").wait_for()
    assert measurements.locator("[data-name=find]").is_visible()  # what was unfolded stays so
    assert measurements.locator("iframe").get_attribute("sandbox") == "allow-scripts"
    answer = measurements.request.get(f"{served.address}{measurements.locator('iframe').get_attribute('src')}")
    assert answer.headers["content-security-policy"].startswith("sandbox allow-scripts; default-src 'none'")
    (file,) = served.folder.glob("diagnose_*/diagnosis.json")  # as the command line has left it
    by_page, by_python = json.loads(file.read_text()), bs.diagnose(small, "strip", ["taper"], seed=0)
    assert by_page | {"provenance": 0} == json.loads(json.dumps(file_json(by_python))) | {"provenance": 0}
    assert by_python.headline in " ".join((file.parent / "log.txt").read_text().split())


def test_work_can_be_stopped(measurements, small):
    drop(measurements, *small.iterdir())
    measurements.get_by_text("step: 4 runs").wait_for()
    measurements.get_by_role("button", name="Diagnose").click()
    measurements.get_by_role("button", name="Stop").click()
    measurements.get_by_text("Stopped after").wait_for()
    assert measurements.get_by_role("button", name="Diagnose").is_enabled()


def test_files_that_cannot_be_used_have_one_clear_line(measurements, small, tmp_path):
    (tmp_path / "my_effect.py").write_text("raise SystemExit('run')")
    drop(measurements, tmp_path / "my_effect.py")
    (line,) = alerts(measurements)
    assert "my_effect.py: is not read by this page" in line

    (tmp_path / "campaign.yaml").write_text(
        (small / "campaign.yaml").read_text().replace("unit: mm", "unit: furlong", 1)
    )
    drop(measurements, tmp_path / "campaign.yaml", small / "runs.csv", small / "signals.csv")
    measurements.get_by_role("alert").filter(has_text="furlong").wait_for()
    assert all("\n" not in line for line in alerts(measurements))


def test_more_than_the_page_takes_is_refused_with_a_way_out(measurements, tmp_path):
    large = tmp_path / "large.csv"
    with large.open("wb") as file:
        file.truncate(MAX_UPLOAD + 1)
    drop(measurements, large)
    (line,) = alerts(measurements)
    assert line.startswith("files: refused; at most 256 MB at a time; drop fewer at once")


def test_html_in_a_campaign_stays_text(measurements, small, tmp_path):
    evil = "<img src=x onerror=document.title=1>"
    (tmp_path / "campaign.yaml").write_text(
        (small / "campaign.yaml").read_text().replace("title: A steel belt", f"title: {evil} A steel belt")
    )
    drop(measurements, tmp_path / "campaign.yaml", small / "runs.csv", small / "signals.csv")
    measurements.get_by_text("onerror").first.wait_for()
    (tmp_path / "runs.csv").write_text((small / "runs.csv").read_text().replace("r01", "<b>r01</b>"))
    drop(measurements, tmp_path / "runs.csv")
    measurements.get_by_role("alert").filter(has_text="<b>r01</b>").wait_for()
    assert not measurements.locator("img, b:text('r01')").count()


def test_a_loggers_files_become_a_campaign(measurements, small, tmp_path):
    rows = [line.split(",") for line in (small / "signals.csv").read_text().splitlines()[1:]]
    for run, name in (("r01", "lauf1_7Nmm2_-0,042grad.csv"), ("r05", "lauf2_20Nmm2.csv")):
        said = [";".join(row[1:]).replace(".", ",") for row in rows if row[0] == run]
        (tmp_path / name).write_text("\n".join(["Bandweg [m];Kante 1 [mm];Kante 4 [mm]", *said]) + "\n")
    drop(measurements, *tmp_path.glob("lauf*.csv"))
    measurements.get_by_text("What your files seem to say").wait_for()
    take = measurements.get_by_role("button", name="Use this data")
    assert not take.is_enabled()
    for group, known in (("machine", "test_rig"), ("belt", "paper_belt")):
        measurements.locator(f"[data-name={group}]").click()
        measurements.get_by_role("option", name=known).click()
    yaw = measurements.locator(".grid.runs").get_by_placeholder("-0.042 deg").nth(1)
    yaw.fill("-0.042 deg")
    measurements.wait_for_timeout(NOTED)
    measurements.reload()  # before anybody asked for another look: the answers stay
    yaw.wait_for()
    assert yaw.input_value() == "-0.042 deg"
    measurements.get_by_role("button", name="Update").click()
    measurements.wait_for_selector(DRAWN.format("measured"), state="attached")
    take.click()
    measurements.get_by_text("2. What was understood").wait_for()
    measurements.get_by_text("grad.csv, lauf2_20Nmm2.csv: 2 runs").wait_for()


def test_the_address_keeps_the_settings_and_numbers_can_be_taken_along(page, served):
    curve = simulate_page(page, served)
    page.get_by_label("tension number").fill("33")
    curve = curve_other_than(page, curve)
    page.locator("[data-name=find]").fill("hot")
    page.get_by_text("Temperature difference: a belt").click()
    curve = curve_other_than(page, curve)
    page.wait_for_function("location.search.includes('temperature_difference')")
    page.reload()
    assert curve_other_than(page, None) == curve
    assert page.get_by_label("tension number").input_value() == "33"
    assert page.get_by_text("temperature at +y less that at -y [K]").is_visible()
    for name, begins in (("CSV", b"travel_m,y1_mm"), ("PNG", b"\x89PNG")):
        with page.expect_download() as got:
            page.get_by_role("button", name=name).click()
        assert got.value.path().read_bytes().startswith(begins)


def test_a_drop_anywhere_on_the_page_is_taken_and_its_campaign_can_be_had(measurements, small):
    """A drop on the headline, as a browser makes it."""
    texts = {file.name: file.read_text() for file in small.iterdir()}
    before = measurements.locator("[data-version]").get_attribute("data-version")
    measurements.evaluate(
        """texts => { const drop = new DataTransfer();
        for (const [name, text] of Object.entries(texts)) drop.items.add(new File([text], name));
        const heard = { dataTransfer: drop, bubbles: true, cancelable: true };
        document.querySelector('header').dispatchEvent(new DragEvent('drop', heard)); }""",
        texts,
    )
    measurements.locator(f"[data-version]:not([data-version='{before}'])").wait_for(state="attached")
    measurements.get_by_text("step: 4 runs").wait_for()
    with measurements.expect_download() as got:
        measurements.locator("[data-name=campaign]").click()
    names = zipfile.ZipFile(io.BytesIO(got.value.path().read_bytes())).namelist()
    assert {n.split("/")[-1] for n in names if not n.endswith("/")} == set(texts)


def test_a_sensor_is_put_in_its_place_on_the_sketch(measurements, tmp_path):
    rows = "".join(f"{0.5 * k};{0.1 * k};{0.05 * k}\n" for k in range(40))
    (tmp_path / "lauf1_7Nmm2_-0,042grad.csv").write_text(f"Bandweg [m];Laser A [mm];Laser B [mm]\n{rows}")
    drop(measurements, *tmp_path.glob("*.csv"))
    measurements.get_by_role("button", name="Laser B [mm]").click()
    measurements.locator("[data-name=spot-point_3]").click()
    field = measurements.locator("[data-name='columns.Laser_B__mm_.at']")
    field.get_by_text("point 3").wait_for()
    assert "point 3" not in measurements.locator("[data-name='columns.Laser_A__mm_.at']").inner_text()
