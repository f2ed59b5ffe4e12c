"""The decision page in a headless browser, offline: what a reader does and sees."""

import csv
import io
import shutil

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import rank_of_efficiency
from pymoo_psi.page import decision_page
from pymoo_psi.page._data import DOMINATED, OPTIMUM, PROTOTYPE
from pymoo_psi.page._page import MOST_ROWS
from pymoo_psi.table import read_designs
from tests.beams import CRITERIA, SETTINGS, beams
from tests.formulas import CELLS, INERT
from tests.table.exact_csv import EXACT

pytest.importorskip("bokeh", reason="the extra 'page' is not installed")


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next((path for name in names if (path := shutil.which(name))), None)
    if program is None:
        pytest.skip("no Chromium on this machine: apt-get install chromium")
    switches = (
        "headless no-sandbox disable-gpu disable-quic no-first-run disable-background-networking"
        " disable-component-update disable-sync"
    )
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program, args=[f"--{switch}" for switch in switches.split()]
        )
        yield browser
        browser.close()


class Reader:
    """Someone in front of the page, without a network; looks at it and uses its controls."""

    def __init__(self, browser, path):
        self.context = browser.new_context(
            viewport={"width": 1366, "height": 768}, offline=True, accept_downloads=True
        )
        self.page = self.context.new_page()
        self.trouble = []
        self.page.on(
            "console",
            lambda m: m.type in ("error", "warning") and self.trouble.append(m.text),
        )
        self.page.on("pageerror", lambda error: self.trouble.append(str(error)))
        self.page.on(
            "request",
            lambda r: r.url.startswith(("file:", "data:", "blob:")) or self.trouble.append(r.url),
        )
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("body[data-ready]")

    def model(self, name, expression):
        return self.page.evaluate(
            f"(() => {{const m = Bokeh.documents[0].get_model_by_name('{name}'); return {expression}}})()"
        )

    def settle(self):
        self.page.evaluate(
            "() => new Promise(f => requestAnimationFrame(() => requestAnimationFrame(f)))"
        )

    @property
    def left(self):
        """Rows the table shows, in its order."""
        return self.page.evaluate(
            "[...Bokeh.index.get_by_id(Bokeh.documents[0].get_model_by_name('table').id).data.index]"
        )

    @property
    def selected(self):
        return sorted(self.model("designs", "[...m.selected.indices]"))

    def drawn(self, plot):
        """Rows a scatter plot draws."""
        return self.page.evaluate(
            f"[...Bokeh.index.find_one_by_id(Bokeh.documents[0].get_model_by_name('{plot}').renderers[0].id).all_indices]"
        )

    def picture(self, panel):
        return self.page.locator(f"#panel-{panel} .plot").screenshot()

    def brush(self, panel, corner, opposite):
        """Drag a box; corners as shares of the frame of axes, from its upper left."""
        box = self.page.evaluate(
            f"""(() => {{const view = Bokeh.index.get_by_id(Bokeh.documents[0].get_model_by_name('{panel}').id)
            const {{left, top, width, height}} = view.frame.bbox
            const at = view.el.getBoundingClientRect()
            return [at.x + left, at.y + top, width, height]}})()"""
        )
        before = self.selected
        for _ in range(5):
            for k, (x, y) in enumerate((corner, opposite)):
                self.page.mouse.move(box[0] + x * box[2], box[1] + y * box[3], steps=4)
                self.settle()  # Bokeh tells a drag from a press by the moves it has seen by then
                self.page.mouse.down() if k == 0 else self.page.mouse.up()
                self.settle()
            if self.selected != before:
                return
            # Where the browser hangs for a moment, Bokeh takes the drag for a long press, and a
            # reader drags again.

    def drag_upper_limit(self, share):
        """Drag the upper end of the first slider to a share of its track."""
        track = self.page.locator("aside .noUi-base").first.bounding_box()
        handle = self.page.locator("aside .noUi-handle-upper").first.bounding_box()
        middle = handle["y"] + handle["height"] / 2
        self.page.mouse.move(handle["x"] + handle["width"] / 2, middle)
        self.page.mouse.down()
        self.page.mouse.move(track["x"] + share * track["width"], middle, steps=4)
        self.page.mouse.up()
        self.settle()

    def cells(self, column):
        """Texts of the visible cells of a column, from above."""
        return self.page.locator(f"#panel-table .slick-row .slick-cell.l{column}").all_inner_texts()

    def export(self):
        with self.page.expect_download() as download:
            self.page.click("#export")
        self.file_name = download.value.suggested_filename
        with open(download.value.path(), encoding="utf-8", newline="") as file:
            return file.read()


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    decision_page(beams(), CRITERIA, **SETTINGS).save(path)
    return path


@pytest.fixture(scope="module")
def data():
    return decision_page(beams(), CRITERIA, **SETTINGS)


@pytest.fixture(scope="module")
def opened(browser, page_file):
    reader = Reader(browser, page_file)
    yield reader
    reader.context.close()


@pytest.fixture
def reader(opened):
    """The page as it was opened, but for its axes and the order of its table."""
    if opened.page.is_enabled("#reset"):
        opened.page.click("#reset")
    opened.page.mouse.move(5, 760)
    opened.settle()
    yield opened
    assert opened.trouble == []


@pytest.fixture
def fresh(browser, page_file):
    """The page in a browser of its own."""
    reader = Reader(browser, page_file)
    yield reader
    reader.context.close()
    assert reader.trouble == []


def test_it_opens_without_a_network(reader, data):
    text = reader.page.inner_text("body")
    assert "Beams <&> such" in text
    shown = np.flatnonzero(data.group != DOMINATED)
    assert sorted(reader.left) == reader.drawn("criteria") == shown.tolist()
    assert f"{len(shown) - 1} of 400 designs" in text
    assert f"Salukvadze optimum: number {data.optima[0]}" in text
    assert f"Export {len(shown)} shown as CSV" in text
    assert reader.cells(0)[:2] == ["prototype", data.optima[0]]
    assert reader.cells(1)[:2] == ["prototype", "6 ★"]
    size = reader.page.evaluate("[document.body.scrollWidth, document.body.scrollHeight]")
    assert size == [1366, 768]


def test_brushing_selects_everywhere(reader, data):
    before = {name: reader.picture(name) for name in ("variables", "geometric", "parallel")}
    reader.brush("criteria", (0.02, 0.02), (0.5, 0.6))
    x, y = data.columns[0].values, data.columns[1].values
    (x0, x1), (y0, y1) = (
        reader.model("criteria", f"[m.{a}_range.start, m.{a}_range.end]") for a in "xy"
    )
    inside = x <= x0 + 0.5 * (x1 - x0)
    inside &= (x >= x0 + 0.02 * (x1 - x0)) & (y >= y1 - 0.6 * (y1 - y0)) & (data.group != DOMINATED)
    expected = np.flatnonzero(inside & (y <= y1 - 0.02 * (y1 - y0)))
    assert 5 < len(expected) < 300
    assert len(set(reader.selected) ^ set(expected)) <= 2  # those at the edge, within a pixel
    assert f"{len(reader.selected)} selected" in reader.page.inner_text("header")
    lines = reader.model("lines", "m.selected.indices.map((k) => m.data.row[k])")
    assert sorted(lines) == reader.selected
    view = "Bokeh.index.get_by_id(Bokeh.documents[0].get_model_by_name('table').id)"
    marked = reader.page.evaluate(f"{view}.grid.getSelectedRows().map((k) => {view}.data.index[k])")
    assert sorted(marked) == reader.selected
    reader.page.mouse.move(5, 700)
    reader.page.wait_for_timeout(300)
    for name, picture in before.items():
        assert reader.picture(name) != picture, name
    reader.page.click("#clear")
    assert reader.selected == []


def test_a_limit_removes_rows_from_table_and_plots(reader, data):
    reader.drag_upper_limit(0.5)
    low, high = reader.model("limit_c0", "m.value")
    mass = data.columns[0].values
    assert mass.min() <= low < high < (mass.min() + mass.max()) / 2 * 1.05
    expected = np.flatnonzero(
        (data.group == PROTOTYPE) | (data.group != DOMINATED) & (mass <= high)
    )
    assert 1 < len(expected) < 300
    assert sorted(reader.left) == expected.tolist()
    for plot in ("criteria", "variables", "geometric"):
        assert reader.drawn(plot) == expected.tolist()
    assert reader.model("lines", "[...m.data.row]") == expected.tolist()
    assert reader.model("lines", "m.data.ys.flat().filter((y) => y < 0 || y > 1)") == []
    assert f"{len(expected) - 1} of 400 designs" in reader.page.inner_text("#count")
    reader.page.click("#reset")
    assert len(reader.left) == (data.group != DOMINATED).sum()


def test_a_limit_drops_what_it_hides_from_the_selection(reader):
    reader.brush("criteria", (0.01, 0.01), (0.99, 0.99))
    before = reader.selected
    reader.drag_upper_limit(0.5)
    assert 0 < len(reader.selected) < len(before)
    assert set(reader.selected) <= set(reader.left)


def test_ranks_are_switched(reader, data):
    for box in reader.page.locator("#ranks input").all():
        box.set_checked(box.get_attribute("value") in ("6", "4"))
    reader.settle()
    expected = np.flatnonzero(np.isin(data.group, (4, OPTIMUM, PROTOTYPE)))
    assert sorted(reader.left) == reader.drawn("geometric") == expected.tolist()
    for box in reader.page.locator("#ranks input").all():
        box.set_checked(box.get_attribute("value") == str(DOMINATED))
    reader.settle()
    expected = np.flatnonzero(np.isin(data.group, (DOMINATED, PROTOTYPE)))
    assert sorted(reader.left) == expected.tolist()
    assert "not among them" in reader.page.inner_text("#optimum")
    assert "dominated" in reader.cells(1)


def test_export_gives_exactly_the_rows_shown(reader, data, tmp_path):
    reader.page.locator("#ranks input[value='0']").set_checked(False)
    reader.settle()
    rows = reader.left
    assert 4 < len(rows) < 20
    text = reader.export()
    assert reader.file_name == "Beams_such-shown.csv"
    exported = pd.read_csv(
        io.StringIO(text),
        comment="#",
        dtype={"number": str},
        keep_default_na=False,
        **EXACT,
    )
    names = ["number", *CRITERIA, "width", "material", "mu1", "mu2", "mu3", "rank", "mark"]
    assert list(exported.columns) == names
    assert exported["number"].tolist() == [str(data.labels[i]) for i in rows]
    for name, column in zip(names[1:4], data.columns, strict=False):
        np.testing.assert_array_equal(exported[name], column.values[rows])  # every digit
    assert exported["material"].tolist() == data.columns[4].values[rows].tolist()
    assert exported["mark"].tolist() == data.marks[rows].tolist()
    assert exported["rank"][0] == ""  # a prototype has none
    # It is ranked, and shown again, in the senses and units of the page.
    (tmp_path / "export.csv").write_text(text, "utf-8")
    file = read_designs(tmp_path / "export.csv")
    roles = file.roles()
    assert (roles.objectives, roles.maximize) == (tuple(CRITERIA), ("strength",))
    assert (roles.variables, roles.label) == (("width", "material"), "number")
    assert {name: file.columns[name].unit for name in ("mass", "width")} == SETTINGS["units"]


def test_export_gives_the_selection_if_there_is_one(reader, data):
    reader.brush("geometric", (0.01, 0.5), (0.5, 0.99))
    selected = reader.selected
    assert 2 < len(selected) < 300
    assert f"Export {len(selected)} selected" in reader.page.inner_text("#export")
    exported = pd.read_csv(io.StringIO(reader.export()), comment="#", **EXACT)
    assert sorted(exported["number"].astype(str)) == sorted(str(data.labels[i]) for i in selected)
    assert reader.file_name == "Beams_such-selected.csv"
    reader.page.click("#keep")
    expected = {*selected, len(data.labels) - 1}  # the prototype stays
    assert set(reader.left) == expected
    assert reader.selected == []


def test_the_table_sorts(fresh, data):
    for descending in (False, True):
        fresh.page.locator("#panel-table .slick-header-column", has_text="mass [kg]").click()
        fresh.settle()
        cells = [float(cell) for cell in fresh.cells(2)]
        assert len(cells) > 8
        assert cells == sorted(cells, reverse=descending)
        mass = data.columns[0].values[fresh.left]
        assert (np.diff(mass) * (-1 if descending else 1) >= 0).all()
        exported = pd.read_csv(io.StringIO(fresh.export()), comment="#", **EXACT)
        np.testing.assert_array_equal(exported["mass"], mass)


def test_axes_are_chosen(fresh, data):
    fresh.page.select_option("select[data-plot='criteria'][data-axis='y']", label="strength (max)")
    fresh.settle()
    assert fresh.model("criteria", "m.left[0].axis_label.text") == "strength (max)"
    strength = data.columns[2].values[data.group != DOMINATED]
    start, end = fresh.model("criteria", "[m.y_range.start, m.y_range.end]")
    assert start < strength.min() < strength.max() < end
    fresh.brush("criteria", (0.0, 0.0), (1.0, 0.5))
    chosen = data.columns[2].values[fresh.selected]
    assert len(chosen) > 3
    assert chosen.min() >= (start + end) / 2 - 0.02 * (end - start)


def test_hovering_tells_number_and_values(reader, data):
    best = int(np.flatnonzero(data.group == OPTIMUM)[0])
    x, y = (data.columns[j].values[best] for j in (0, 1))
    spot = reader.page.evaluate(
        f"""(() => {{const view = Bokeh.index.get_by_id(Bokeh.documents[0].get_model_by_name('criteria').id)
        const at = view.el.getBoundingClientRect()
        return [at.x + view.frame.x_scale.compute({x}), at.y + view.frame.y_scale.compute({y})]}})()"""
    )
    reader.page.mouse.move(spot[0] - 3, spot[1])
    reader.page.mouse.move(*spot)
    tip = reader.page.locator(".bk-Tooltip").first
    tip.wait_for(state="attached")
    text = tip.evaluate("(element) => element.shadowRoot.textContent")
    assert data.optima[0] in text
    assert f"{x:.3f}" in text
    assert "mass [kg]" in text


def test_nothing_left_is_said(reader):
    for handle in reader.page.locator("aside .noUi-handle-upper").all():
        handle.focus()
        handle.press("Home")
    reader.settle()
    assert reader.page.inner_text("#count") == "No design is left: widen the limits"
    assert len(reader.left) == 1  # the prototype
    reader.page.click("#reset")
    assert "of 400 designs" in reader.page.inner_text("#count")


def test_no_rank_switched_on_is_no_matter_of_limits(reader):
    for box in reader.page.locator("#ranks input").all():
        box.set_checked(False)
    reader.settle()
    assert reader.page.inner_text("#count") == "No design is left: switch on more ranks"
    assert reader.page.is_disabled("#fit") == (len(reader.left) == 0)
    for handle in reader.page.locator("aside .noUi-handle-upper").all():
        handle.focus()
        handle.press("Home")
    reader.settle()
    assert reader.page.inner_text("#count") == "No design is left: widen the limits"


def test_axes_are_fitted_to_what_is_left(reader, data):
    ends = "[m.x_range.start, m.x_range.end]"
    before = reader.model("geometric", ends)
    reader.drag_upper_limit(0.4)
    assert reader.model("geometric", ends) == before  # limits leave them be
    reader.page.click("#fit")
    start, end = reader.model("geometric", ends)
    mu3 = data.columns[-1].values[reader.left]
    margin = 0.05 * (mu3.max() - mu3.min())
    np.testing.assert_allclose([start, end], [mu3.min() - margin, mu3.max() + margin])
    assert end - start < 0.95 * (before[1] - before[0])
    reader.page.click("#reset")
    assert reader.model("geometric", ends) == before


def test_ranks_and_distances_are_explained(reader):
    assert not reader.page.is_visible("details p >> nth=0")
    reader.page.click("summary")
    text = reader.page.inner_text("details")
    for word in ("μ1 is a design's distance to U", "Rank 6", "in units of its range", "dominated"):
        assert word in text
    reader.page.click("summary")


def test_narrow_windows_have_no_controls_outside(fresh):
    for width in (1000, 700, 420):
        fresh.page.set_viewport_size({"width": width, "height": 800})
        fresh.settle()
        fresh.page.wait_for_timeout(300)
        assert fresh.page.evaluate("document.documentElement.scrollWidth") == width
        for control in fresh.page.locator("button, select, summary, #ranks label, h1").all():
            box = control.bounding_box()
            assert box["x"] >= 0, control
            assert box["x"] + box["width"] <= width, control
            assert box["width"] > 10, control
        for name in ("criteria", "variables", "geometric", "parallel", "table"):
            box = fresh.page.locator(f"#panel-{name} .plot").bounding_box()
            assert 250 <= box["width"] <= width
            assert box["height"] > 200


def test_a_page_opens_with_limits(browser, tmp_path, data):
    limits = {"mass": 0.6, "strength": -0.8}  # at most; at least, as more of it is better
    decision_page(beams(), CRITERIA, limits=limits, **SETTINGS).save(tmp_path / "page.html")
    reader = Reader(browser, tmp_path / "page.html")
    mass, strength = data.columns[0].values, data.columns[2].values
    within = (mass <= 0.6) & (strength >= -0.8) & (data.group != DOMINATED)
    expected = np.flatnonzero(within | (data.group == PROTOTYPE))
    assert 2 < len(expected) < 200
    assert sorted(reader.left) == expected.tolist()
    assert reader.model("criteria", "m.x_range.end") == pytest.approx(
        1.4 + 0.05 * (1.4 - mass[expected].min())  # the prototype's mass
    )
    reader.page.click("#reset")
    assert len(reader.left) == (data.group != DOMINATED).sum()
    assert reader.trouble == []
    reader.context.close()


HOSTILE = [
    r"$$\href{javascript:document.title='run'}{a}$$",
    r"\(\require{html}\style{background:url(https://example.org/b)}{b}\)",
    """c"><img src="https://example.org/c" onerror="document.title='run'">""",
    "$$d$$ </script><script>document.title='run'</script>",
]


@pytest.fixture(scope="module")
def attacked(browser, tmp_path_factory):
    """A page all of whose names, labels and texts are hostile."""
    rng = np.random.default_rng(1)
    frame = pd.DataFrame(rng.random((30, 3)), columns=HOSTILE[:3])
    frame[HOSTILE[3]] = [HOSTILE[i % 4] for i in range(30)]
    frame["number"] = [f"{HOSTILE[i % 4]} {i}" for i in range(30)]
    page = decision_page(
        frame.rename(columns={"number": HOSTILE[0] + " label"}),
        HOSTILE[:2],
        variables=HOSTILE[2:],
        units=dict.fromkeys(HOSTILE, HOSTILE[0]),
        label=HOSTILE[0] + " label",
        title=HOSTILE[2],
    )
    path = tmp_path_factory.mktemp("page") / "page.html"
    page.save(path)
    reader = Reader(browser, path)
    yield reader
    reader.context.close()


def test_names_are_text(attacked):
    for select in attacked.page.locator("select[data-plot]").all():
        for option in select.locator("option").all():
            select.select_option(option.get_attribute("value"))
            attacked.settle()
    attacked.page.mouse.move(600, 200)
    attacked.page.wait_for_timeout(300)
    assert attacked.page.title() == HOSTILE[2]
    assert attacked.trouble == []
    assert attacked.page.locator("img, a[href], mjx-container, [onerror]").count() == 0
    labels = [f"{name} [{HOSTILE[0]}]" for name in HOSTILE]
    shown = attacked.page.inner_text("aside")
    assert labels[0] in shown
    assert labels[1] in shown
    named = "m.below[0].axis_label.type + m.left[0].axis_label.type"
    assert attacked.model("criteria", named) == 2 * "PlainText"
    assert set(attacked.cells(0)) <= {f"{name} {i}" for name in HOSTILE for i in range(30)}


def test_what_got_in_nevertheless_loads_and_runs_nothing(attacked):
    """The page's policy stops it, not only the want of a network."""
    before = attacked.page.title()
    for attack in (
        "document.body.append(Object.assign(document.createElement('script'), {text: 'document.title = 1'}))",
        "document.body.append(Object.assign(document.createElement('script'), {src: 'https://example.org/'}))",
        "document.body.append(Object.assign(document.createElement('img'), {src: 'https://example.org/'}))",
        "document.body.append(Object.assign(document.createElement('iframe'), {src: 'https://example.org/'}))",
        "document.body.insertAdjacentHTML('beforeend', '<b style=\"background: url(https://example.org/)\">x</b>')",
        "document.body.insertAdjacentHTML('beforeend', '<img src=\"data:,\" onerror=\"document.title = 1\">')",
        "fetch('https://example.org/').catch(() => 0)",
        "navigator.sendBeacon('https://example.org/')",
    ):
        attacked.page.evaluate(
            f"""new Promise((done) => {{
                const options = {{once: true}}
                document.addEventListener('securitypolicyviolation', () => done(true), options)
                {attack} }})"""
        )
        assert attacked.page.title() == before


def test_exported_texts_are_no_formulas(browser, tmp_path):
    half = len(CELLS) // 2
    a = np.linspace(-1.5, 2.0, half)
    frame = pd.DataFrame({"-a": a, "b": a[::-1], "note": CELLS[:half], "id": CELLS[half:]})
    decision_page(frame, ["-a", "b"], variables=["note"], label="id").save(tmp_path / "p.html")
    reader = Reader(browser, tmp_path / "p.html")
    exported = list(csv.DictReader(io.StringIO(reader.export(), newline="")))
    assert {float(row["'-a"]) for row in exported} == set(a)
    assert {row["note"] for row in exported} == {INERT[cell] for cell in CELLS[:half]}
    assert {row["id"] for row in exported} == {INERT[cell] for cell in CELLS[half:]}
    assert reader.trouble == []
    reader.context.close()


@pytest.mark.parametrize(
    ("frame", "objectives"),
    [
        (pd.DataFrame({"a": [1.0, 2.0], "b": [2.0, 1.0]}), ["a", "b"]),
        (pd.DataFrame({"a": [1.0, 2.0], "b": [2.0, 2.0]}), ["a"]),
        (pd.DataFrame({"a": [1.0, 2.0], "b": [2.0, 1.0], "c": [3.0, 3.0]}), ["a", "b", "c"]),
    ],
    ids=["two", "one criterion", "a constant one"],
)
def test_small_sets(browser, tmp_path, frame, objectives):
    decision_page(frame, objectives).save(tmp_path / "page.html")
    reader = Reader(browser, tmp_path / "page.html")
    assert len(reader.left) == rank_of_efficiency(frame[objectives]).pareto.sum()
    assert ("c: the same for all" in reader.page.inner_text("aside")) == ("c" in objectives)
    assert reader.trouble == []
    reader.context.close()


def test_4000_rows_open(browser, tmp_path):
    frame = beams(4000, noise=0.0)
    html = decision_page(frame, CRITERIA, variables=["width"], maximize=["strength"]).html()
    assert len(html) < 5e6
    (tmp_path / "page.html").write_text(html, encoding="utf-8")
    reader = Reader(browser, tmp_path / "page.html")
    assert len(reader.left) > 3000
    assert reader.trouble == []
    reader.context.close()


def test_many_rows_are_told_of(browser, tmp_path):
    a = np.linspace(0, 1, MOST_ROWS + 1)
    frame = pd.DataFrame({"a": a, "b": (1 - np.sqrt(a)) ** 2})
    decision_page(frame, ["a", "b"]).save(tmp_path / "p.html")
    reader = Reader(browser, tmp_path / "p.html")
    assert "Of 20\u202f001 designs the" in reader.page.inner_text("aside")
    assert reader.trouble == []
    reader.context.close()
