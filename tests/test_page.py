"""The decision page: its data in Python, and the page itself in a headless browser, offline."""

import io
import re
import shutil
import time

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import PsiError, TestTable, VectorizedSphereChute, investigate, rank_of_efficiency
from pymoo_psi.cli import main
from pymoo_psi.page import decision_page, page_data, save_page, table_from_file
from pymoo_psi.page.content import MOST_ROWS
from pymoo_psi.page.groups import DOMINATED, OPTIMUM, PROTOTYPE, look

pytest.importorskip("bokeh", reason="the extra 'page' is not installed")

CRITERIA = ["mass", "cost, total", "strength"]
SETTINGS = {
    "variables": ["width", "material"],
    "maximize": ["strength"],
    "units": {"mass": "kg", "width": "mm"},
    "label": "number",
    "title": "Beams <&> such",
    "prototype": {"mass": 1.4, "cost, total": 90.0, "strength": 0.2, "width": 5.0},
}


def beams(n=400, noise=0.1):
    """Designs on a bent front, some of them dominated; numbered 1001, 1002, …"""
    rng = np.random.default_rng(7)
    F = np.abs(rng.normal(size=(n, 3)))
    F = (1.2 - F / np.linalg.norm(F, axis=1)[:, None]) ** 1.5 * [1, 2, 1]
    F += noise * rng.random((n, 1)) ** 2
    F[:, 2] += 0.3 * F[:, 0]
    frame = pd.DataFrame(F * [1, 100, -1], columns=CRITERIA)
    frame["width"] = rng.random(n) * 20
    frame["material"] = rng.choice(["steel", "<b>wood</b>"], n)
    frame["number"] = np.arange(1001, 1001 + n)
    return frame


# The data


def test_columns_groups_and_order():
    frame = beams()
    data = page_data(frame, CRITERIA, **SETTINGS)
    ranking = rank_of_efficiency(frame[CRITERIA] * [1, 1, -1])
    assert [column.label for column in data.columns] == [
        "mass [kg]", "cost, total", "strength (max)", "width [mm]", "material",
        "μ1 (to U)", "μ2 (to line UN)", "μ3 (along UN)",
    ]  # fmt: skip
    assert data.labels[-1] == "prototype"  # drawn last, on top
    assert data.group[-1] == PROTOTYPE
    assert data.rank[-1] == -1
    rows = np.array([int(label) for label in data.labels[:-1]]) - 1001
    assert sorted(rows) == list(range(400))
    np.testing.assert_array_equal(data.rank[:-1], ranking.rank[rows])
    np.testing.assert_array_equal(data.group[:-1] == DOMINATED, ~ranking.pareto[rows])
    np.testing.assert_array_equal(data.columns[0].values[:-1], frame["mass"][rows])
    np.testing.assert_allclose(data.columns[-3].values[:-1], ranking.criteria[rows, 0], rtol=1e-14)
    U, span = ranking.ideal, ranking.nadir - ranking.ideal
    np.testing.assert_allclose(
        data.columns[-3].values[-1], np.linalg.norm(([1.4, 90.0, -0.2] - U) / span)
    )
    assert data.optima == [str(1001 + i) for i in ranking.salukvadze]
    assert (np.diff(data.group) >= 0).all()


def test_optimum_without_rank_6_is_marked_and_told():
    angle = np.linspace(0.2, 1.3, 7)
    F = 1 - np.column_stack([np.cos(angle), np.sin(angle)])
    frame = pd.DataFrame(np.sqrt([[1, 4], [2, 3], [3, 2], [4, 1]]), columns=["a", "b"])
    for circle, expected in ((frame, 4), (pd.DataFrame(F, columns=["a", "b"]), 1)):
        ranking = rank_of_efficiency(circle, normalize=False, ideal=None)
        data = page_data(circle, ["a", "b"], normalize=False)
        assert (data.group == OPTIMUM).sum() == len(ranking.salukvadze) <= expected
        assert bool(data.remarks) == (not (ranking.rank == 6).any())


def test_looks_are_those_of_the_figures():
    from pymoo_psi.figures.style import MARKERS

    for rank in (3, 4, 5, 6):
        assert look(rank).colour == MARKERS[rank].colour
    assert look(0).colour == "#ADADAD"
    shapes = [look(group).shape for group in (0, 3, 4, 5, 6, PROTOTYPE)]
    assert len(set(shapes)) == len(shapes)


def test_beyond_many_rows_only_ranked_ones_are_shown():
    n = MOST_ROWS + 1
    a = np.linspace(0, 1, n)
    frame = pd.DataFrame({"a": a, "b": (1 - np.sqrt(a)) ** 2})
    assert len(page_data(frame.iloc[:-1], ["a", "b"]).labels) == MOST_ROWS
    data = page_data(frame, ["a", "b"])
    ranked = rank_of_efficiency(frame).rank > 0
    assert sorted(data.labels) == np.flatnonzero(ranked).tolist()
    assert re.match(r"Of 20.001 designs the .* ranked ones are shown\.", data.remarks[0])


@pytest.mark.parametrize(
    ("values", "notation"),
    [
        ([1.98291, 2.0454], ("fixed", 5)),
        ([1.0, 7.0], ("fixed", 0)),
        ([100.5, 900.0], ("fixed", 1)),
        ([1e-9, 3e-9], ("exponent", 3)),
        ([1e12, 3e12], ("exponent", 3)),
        ([0.25, 0.25], ("fixed", 4)),
        ([np.nan, np.nan], ("fixed", 0)),
    ],
)
def test_numbers_are_written_with_digits_that_tell_designs_apart(values, notation):
    from pymoo_psi.page.columns import Column

    assert Column("c0", "a", "", "criterion", False, np.array(values)).notation == notation


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objectives": ["mas"]}, "objectives must be one of .* got 'mas'; did you mean 'mass'?"),
        ({"objectives": []}, "objectives must be names of one column or more"),
        ({"objectives": "mass"}, "objectives must be a list of names, got 'mass'"),
        ({"objectives": ["mass", "mass"]}, "objectives must be columns that are named once"),
        ({"objectives": ["material"], "variables": (), "maximize": (), "prototype": None, "units": {}}, "column 'material' must be numbers, got .* in row 1"),
        ({"variables": ["depth"]}, "variables must be one of"),
        ({"variables": ["mass"]}, "variables must be columns that are named once, got 'mass'"),
        ({"maximize": ["width"]}, "maximize must be one of 'cost, total', 'mass', 'strength'"),
        ({"units": {"depth": "m"}}, "units must be one of"),
        ({"label": "name"}, "label must be one of"),
        ({"limits": {"width": 1.0}}, "limits must be one of 'cost, total', 'mass', 'strength'"),
        ({"limits": {"mass": "1"}}, "the limit on 'mass' must be a finite number"),
        ({"limits": {"mass": -9.0}}, "the limit on 'mass' must be at least .*, its best value"),
        ({"limits": {"strength": 9.0}}, "the limit on 'strength' must be at most .*, its best"),
        ({"normalize": "no"}, "normalize must be True or False"),
        ({"prototype": {"mass": 1.0}}, "prototype must be a design with a value for every objective"),
        ({"prototype": 3}, "prototype must be a mapping or a pandas.DataFrame, got int"),
        ({"frame": beams().iloc[:0]}, "frame must be of at least two designs .* got 0 rows"),
        ({"frame": beams().iloc[:1]}, "frame must be of at least two designs .* got 1 rows"),
        ({"frame": beams().to_numpy()}, "frame must be a pandas.DataFrame, got ndarray"),
        (
            {"frame": beams().assign(mass=[np.nan, *range(399)])},
            "column 'mass' must be finite, got nan in row 1; leave out designs that failed",
        ),
        (
            {"frame": beams().assign(width=np.inf)},
            "column 'width' must be finite, got inf in row 1",
        ),
    ],
)  # fmt: skip
def test_mistakes(change, message):
    arguments = {"frame": beams(), "objectives": CRITERIA, **SETTINGS, **change}
    with pytest.raises(PsiError, match=message):
        page_data(**arguments)


# Files


def test_any_csv(tmp_path):
    file = tmp_path / "set.csv"
    beams().to_csv(file, index=False)
    table = table_from_file(file)
    assert table.objectives == ("mass", "cost, total", "strength", "width")
    assert (table.label, table.variables) == ("number", ())
    table = table_from_file(file, objectives=["mass", "strength"], variables=["width"])
    assert (table.objectives, table.variables) == (("mass", "strength"), ("width",))


def test_our_own_csv(tmp_path):
    file = tmp_path / "front.csv"
    columns = ["test_point", "x1", "x2", "f1", "f2", "mu1", "mu2", "mu3", "rank"]
    pd.DataFrame(np.ones((2, 9)), columns=columns).to_csv(file, index=False)
    table = table_from_file(file)
    assert (table.objectives, table.variables) == (("f1", "f2"), ("x1", "x2"))
    assert table.label == "test_point"


def test_a_test_table(tmp_path):
    file = tmp_path / "table.csv"
    tests = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
    tests = tests.with_prototype([0.5, 1.0], [2.0, 0.1, 0.5, 1.0], name="P1")
    tests.to_csv(file)
    table = table_from_file(file)
    assert isinstance(TestTable.read_csv(file), TestTable)
    assert (table.objectives, table.variables) == (("f1", "f2", "f3", "f4"), ("x1", "x2"))
    assert table.frame["test_point"].tolist() == tests.numbers[tests.eligible()].tolist()
    data = page_data(
        table.frame,
        table.objectives,
        variables=table.variables,
        label=table.label,
        prototype=table.prototype,
    )
    assert data.label_name == "test_point"
    assert data.labels[-1] == "P1"


def test_the_command(capsys, tmp_path):
    file, out = tmp_path / "set.csv", tmp_path / "page.html"
    beams().to_csv(file, index=False)
    beams().iloc[[3]].to_csv(tmp_path / "old.csv", index=False)
    names = ["--objectives", 'mass, "cost, total",strength', "--maximize", "strength"]
    more = ["--units", "mass=kg", "--prototype", str(tmp_path / "old.csv"), "--out", str(out)]
    more += ["--limits", "mass=0.9,strength>=-0.9"]
    assert main(["page", str(file), *names, *more]) == 0
    assert "400 designs by mass, cost, total, strength: open" in capsys.readouterr().out
    text = out.read_text("utf-8")
    assert text.lstrip().startswith("<!DOCTYPE html>")
    assert "mass [kg]" in text


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("", [], "set.csv: it is empty; it must hold a line of column names"),
        ("a,b\n", [], "set.csv: it holds column names, but no row"),
        ("a,b\n1,2\n", [], "frame must be of at least two designs to decide between, got 1 rows"),
        ("a,b\nx,y\nz,w\n", [], "set.csv: no column holds numbers"),
        ("a,b\n1,2\n3,n/e\n", ["--objectives", "a,b"], "row 2 (line 3) holds text in the number column 'b': 'n/e'"),
        ("a,b\n1,2\n3,1\n", ["--objectives", "a,c"], "objectives must be one of 'a', 'b', got 'c'"),
        ("a,b\n1,2\n3,n/e\n", [], "row 2 (line 3) holds text in the number column 'b': 'n/e'"),
        ("a,b\n1,2\n3,1\n", ["--units", "kg"], "--units must be of the form name=unit"),
        ("a,b\n1,2\n3,1\n", ["--limits", "a>=2"], "--limits must be a<=number here, got a>=2"),
        ("a,b\n1,2\n3,1\n", ["--limits", "a<=2", "--maximize", "a"], "--limits must be a>=number here"),
        ("a,b\n1,2\n3,1\n", ["--limits", "c=2"], "limits must be one of 'a', 'b', got 'c'"),
        ("a,b\n1,2\n3,1\n", ["--out", "absent/page.html"], "No such file or directory"),
        ("a,b\n1,2\n3,1\n", ["--out", "set.csv"], "--out must be another file"),
        ("a,b\n1\n3,1,2\n", [], "row 1 (line 2) has 1 cells, the header 2"),
        ("SQLite format 3\0", [], "must be a study file of pymoo-psi, but it is none"),
    ],
)  # fmt: skip
def test_mistakes_on_the_command_line(capsys, tmp_path, monkeypatch, content, options, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "set.csv").write_text(content)
    assert main(["page", "set.csv", *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["set.csv"]


# The page in a browser


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
        start = time.perf_counter()
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("body[data-ready]")
        self.seconds = time.perf_counter() - start

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
        for k, (x, y) in enumerate((corner, opposite)):
            self.page.mouse.move(box[0] + x * box[2], box[1] + y * box[3], steps=4)
            self.page.mouse.down() if k == 0 else self.page.mouse.up()
        self.settle()

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
    save_page(beams(), CRITERIA, path, **SETTINGS)
    return path


@pytest.fixture(scope="module")
def data():
    return page_data(beams(), CRITERIA, **SETTINGS)


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


def test_export_gives_exactly_the_rows_shown(reader, data):
    reader.page.locator("#ranks input[value='0']").set_checked(False)
    reader.settle()
    rows = reader.left
    assert 4 < len(rows) < 20
    text = reader.export()
    assert reader.file_name == "Beams_such-shown.csv"
    exported = pd.read_csv(io.StringIO(text), dtype={"number": str}, keep_default_na=False)
    names = ["number", *CRITERIA, "width", "material", "mu1", "mu2", "mu3", "rank", "mark"]
    assert list(exported.columns) == names
    assert exported["number"].tolist() == [str(data.labels[i]) for i in rows]
    for name, column in zip(names[1:4], data.columns, strict=False):
        np.testing.assert_array_equal(exported[name], column.values[rows])  # every digit
    assert exported["material"].tolist() == data.columns[4].values[rows].tolist()
    assert exported["mark"].tolist() == data.marks[rows].tolist()
    assert exported["rank"][0] == ""  # a prototype has none


def test_export_gives_the_selection_if_there_is_one(reader, data):
    reader.brush("geometric", (0.01, 0.5), (0.5, 0.99))
    selected = reader.selected
    assert 2 < len(selected) < 300
    assert f"Export {len(selected)} selected" in reader.page.inner_text("#export")
    exported = pd.read_csv(io.StringIO(reader.export()))
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
        exported = pd.read_csv(io.StringIO(fresh.export()))
        np.testing.assert_array_equal(exported["mass"], mass)


def test_axes_are_chosen(fresh, data):
    fresh.page.select_option("select[data-plot='criteria'][data-axis='y']", label="strength (max)")
    fresh.settle()
    assert fresh.model("criteria", "m.left[0].axis_label") == "strength (max)"
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


@pytest.mark.parametrize("width", [1000, 700, 420])
def test_narrow_windows_have_no_controls_outside(fresh, width):
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
    save_page(beams(), CRITERIA, tmp_path / "page.html", limits=limits, **SETTINGS)
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
    save_page(frame, objectives, tmp_path / "page.html")
    reader = Reader(browser, tmp_path / "page.html")
    assert len(reader.left) == rank_of_efficiency(frame[objectives]).pareto.sum()
    assert ("c: the same for all" in reader.page.inner_text("aside")) == ("c" in objectives)
    assert reader.trouble == []
    reader.context.close()


def test_4000_rows_open_within_seconds(browser, tmp_path):
    frame = beams(4000, noise=0.0)
    html = decision_page(frame, CRITERIA, variables=["width"], maximize=["strength"])
    assert len(html) < 5e6
    (tmp_path / "page.html").write_text(html, encoding="utf-8")
    reader = Reader(browser, tmp_path / "page.html")
    assert len(reader.left) > 3000
    assert reader.seconds < 15  # 2 to 4 on a laptop's two cores
    assert reader.trouble == []
    reader.context.close()


def test_many_rows_are_told_of(browser, tmp_path):
    a = np.linspace(0, 1, MOST_ROWS + 1)
    save_page(pd.DataFrame({"a": a, "b": (1 - np.sqrt(a)) ** 2}), ["a", "b"], tmp_path / "p.html")
    reader = Reader(browser, tmp_path / "p.html")
    assert "Of 20\u202f001 designs the" in reader.page.inner_text("aside")
    assert reader.trouble == []
    reader.context.close()


def test_saving_replaces_whole_files_only(tmp_path):
    with pytest.raises(FileNotFoundError):
        save_page(beams(), CRITERIA, tmp_path / "absent" / "page.html")
    (tmp_path / "page.html").write_text("old")
    with pytest.raises(PsiError):
        save_page(beams(), ["absent"], tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == "old"


def test_without_bokeh_the_remedy_is_told(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "bokeh", None)
    with pytest.raises(PsiError, match=r"needs bokeh: pip install 'pymoo-psi\[page\]'"):
        decision_page(beams(), CRITERIA)
