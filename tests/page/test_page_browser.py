"""The decision page in a headless browser, offline: what a reader does and sees."""

import csv
import io
import json
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Decision, explain, rank_of_efficiency
from pymoo_psi._numbers import percent
from pymoo_psi.analysis import positions_frame, separation_sentences
from pymoo_psi.files import read_table
from pymoo_psi.page import decision_page
from pymoo_psi.table import Formulation
from tests.helpers.beams import OBJECTIVES, beams, page_of_beams
from tests.helpers.draws import rarely
from tests.helpers.formulas import CELLS, INERT
from tests.helpers.fronts import on_sphere
from tests.helpers.reader import WINDOW


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    page_of_beams().save(path)
    return path


@pytest.fixture
def reader(visit, page_file):
    """The page as it is when it was opened just now."""
    return visit(page_file)


@pytest.fixture
def laid_open(reader):
    """The page with a choice, a comparison and a limit, nothing folded."""
    reader.set(chosen=reader.shown[2], pins=reader.shown[3:5], limits={"mass": [None, 0.8]})
    reader.page.evaluate(
        "document.querySelectorAll('details').forEach((one) => { one.open = true })"
    )
    reader.settle()
    return reader


def minimised(frame):
    return frame[OBJECTIVES] * [1, 1, -1]


def labels(frame, rows):
    return {str(number) for number in frame["number"].to_numpy()[rows]}


# The verdict


@pytest.fixture
def frame():
    return beams()


def test_it_opens_with_the_best_compromise_in_words(reader, frame):
    ranking = rank_of_efficiency(minimised(frame))
    best = str(frame["number"][ranking.salukvadze[0]])
    told = [reader.text(part) for part in ("#title", "#count", "h1")]
    assert told == ["Beams <&> such", "400 designs", f"Proposed: {best}"]
    assert f"{ranking.pareto.sum()} designs that no other dominates" in reader.text("#foot")
    behind = reader.page.locator("#objectives .share").all_inner_texts()
    shares = [float(text.removesuffix(" %")) / 100 for text in behind]
    assert shares == pytest.approx(explain(ranking).shares, abs=0.005)


def test_a_caution_stands_where_its_proposal_does(show):
    frame = pd.DataFrame({"a": [*range(10), 10.0], "b": [*range(10, 0, -1), -1000.0]})
    page = decision_page(frame)
    reader = show(page)
    text = page.cautions[0]
    assert text in reader.text("#verdict-words")
    reader.type_limit("a, at most", "5")
    assert text not in reader.text("#verdict-words")


# Limits


def test_an_end_of_a_slider_moves_alone(reader):
    low, high = (reader.field(f"mass [kg], {end} limit") for end in ("lower", "upper"))
    reader.press(*["PageDown"] * 3, on=high)
    limit = reader.state["limits"]["mass"][1]
    reader.press(*["PageUp"] * 12, on=low)  # as far as to the upper one, not beyond
    assert reader.state["limits"]["mass"] == [limit, limit]
    reader.press("Home")
    assert reader.state["limits"]["mass"] == [None, limit]


@pytest.mark.parametrize("limits", [{}, {"mass": [None, 0.8], "material": ["steel"]}])
def test_rows_and_table_have_the_numbers_of_python(reader, frame, tmp_path, limits):
    reader.set(limits=limits)
    table = read_table(frame, Decision.read_json(reader.save(tmp_path / "d.json")))
    ranking = table.feasible_ranking()
    order = ranking.by_place[: ranking.pareto.sum()]
    assert reader.shown == ["prototype", *map(ranking.name_of, order)]
    best = table.best().F[0] * table.schema.sign
    cells = reader.page.locator("#objectives .row").locator(".value, .best").all_inner_texts()
    told = np.reshape([float(cell.replace("\N{MINUS SIGN}", "-")) for cell in cells], (3, 3))
    expected = np.c_[best, ranking.nadir, ranking.ideal]
    np.testing.assert_allclose(told, expected, rtol=5e-3, atol=5e-3)
    notes = [f"rejects {(frame['mass'] > 0.8).sum()} of 400"] if limits else []
    assert [*filter(None, reader.page.locator("#objectives .note").all_inner_texts())] == notes
    most = [f"{percent(explain(ranking, row=row).shares.max())} in " for row in order[:3]]
    lines = reader.page.locator("#table-body tr td:last-child").all_inner_texts()[1:]
    assert [text in line for text, line in zip(most, lines, strict=False)] == [True] * 3


def test_what_is_no_number_is_no_limit(reader):
    reader.type_limit("mass [kg], at most", "1.2.3")
    field = reader.field("mass [kg], at most")
    assert not field.evaluate("(field) => field.validity.valid")
    reader.type_limit("cost, total, at least", "0")
    assert field.input_value() == "1.2.3"  # stays to be mended, whatever else is set
    reader.type_limit("cost, total, at least", "")
    assert reader.state["limits"] == {}
    reader.type_limit("mass [kg], at most", "6e-1")
    reader.type_limit("mass [kg], at least", "0.7")
    assert reader.state["limits"] == {"mass": [None, 0.6]}
    message = reader.field("mass [kg], at least").evaluate("(field) => field.validationMessage")
    assert "above the upper" in message


def test_categories_and_dominated_designs_are_ticked(reader, frame):
    reader.click("#further summary >> text=variables")
    # Not the one of the existing design.
    assert reader.page.locator("#further .boxes").inner_text().split() == ["<b>wood</b>", "steel"]
    height = reader.ask("$('rows-area').offsetHeight")
    reader.type_limit("width [mm], at most", "18")
    assert reader.ask("$('rows-area').offsetHeight") == height  # nothing moves under a hand
    reader.set(limits={})
    reader.click(reader.field("steel"))
    rows = np.flatnonzero(frame["material"] != "steel")
    reader.click("#dominated")
    assert set(reader.shown) == labels(frame, rows) | {"prototype"}


# Comparison


def test_the_nearest_better_designs_are_named(reader):
    label = reader.shown[9]
    reader.set(chosen=label)
    names = reader.ask(
        f"D.explain(D.ranking, D.data.rowOf.get('{label}')).steps.map((s) => D.data.names[s.row])"
    )
    shown = reader.page.locator("#steps-list > div").all_inner_texts()
    assert [text.partition(":")[0] for text in shown] == names != []
    reader.press("Enter", on=reader.page.locator("#steps-list button.small").first)
    # The button is a new one; who works by keys stays on it.
    focused = reader.page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert (reader.state["pins"], focused) == (names[:1], f"Compare: {names[0]}")
    reader.click(reader.page.locator("#compare-table").get_by_label(focused))
    assert reader.state["pins"] == []


# Nothing is lost


def test_undo_and_redo(reader):
    states = [reader.state]
    reader.type_limit("mass [kg], at most", "0.7")
    states.append(reader.state)
    # A drag is one step, however many positions it passes.
    reader.drag("[aria-label='cost, total, upper limit']", (0.015, 0.5), (0.4, 0.5))
    states.append(reader.state)
    reader.click("#count")
    reader.press("Control+z")
    assert reader.state == states[1]
    reader.click("#undo")
    assert reader.state == states[0]
    assert reader.page.is_disabled("#undo")
    reader.press("Control+y", "Control+Shift+Z")
    assert reader.state == states[2]
    assert reader.page.is_disabled("#redo")
    # In a field that nobody has typed in the browser would blank another.
    reader.type_limit("mass [kg], at most", "0.6")
    reader.field("cost, total, at least").press("Control+z")
    reader.settle()
    assert reader.state == states[2]


def test_nothing_is_chosen_until_somebody_chooses(reader):
    assert json.loads(reader.download("#save"))["chosen"] is None
    assert reader.file_name == "Beams_such-decision.json"
    best, other = reader.ask("D.data.names[D.verdict.row]"), reader.shown[4]
    reader.set(chosen=other, reason="Stiffer.")
    assert reader.text("h1") == f"Chosen: {other}"
    assert reader.text(".lead").startswith(f"{other} is chosen instead of {best}: ")
    mass = float(reader.page.locator("#objectives .value").first.inner_text())  # of the chosen one
    assert mass == pytest.approx(beams().set_index("number").loc[other, "mass"], abs=1e-3)
    assert json.loads(reader.download("#save"))["chosen"] == other


@pytest.fixture
def member(visit, page_file, tmp_path):
    """Someone of a group, who opens the page anew; returns the decision file."""

    def saved(name, choose, limits):
        reader = visit(page_file)
        for label, value in limits.items():
            reader.type_limit(label, value)
        for k in choose:  # a change of mind is another choice under the same name
            reader.press(*["ArrowDown"] * k, "Enter", "c", on=reader.first_row)
            assert reader.state["chosen"] == reader.shown[k]
            reader.page.keyboard.type(f"{name} wants it.")
            reader.keep_position(name)
        return reader.save(tmp_path / f"{name}.json")

    return saved


@pytest.mark.slow
def test_a_group_decides(visit, page_file, member, tmp_path):
    """Three people, one with a change of mind, all by keys alone; a dissent; one file of all."""
    files = [
        member("Ann", [4], {"mass [kg], at most": "0.9"}),
        member("Ben", [6, 3], {}),
        member("Cy", [8], {"cost, total, at most": "120"}),
    ]
    reader = visit(page_file)
    opened = reader.state
    for some in (files[2], files):  # in another order, and one of them twice
        reader.page.set_input_files("#file", some)
        reader.page.locator("#messages p", has_text="Positions are added.").wait_for()
        reader.click("#messages button:text('Close')")
    # Nothing else has changed.
    assert reader.state | {"positions": []} == opened
    assert [one["name"] for one in reader.state["positions"]] == ["Ann", "Ben", "Ben", "Cy"]
    positions = reader.page.locator("#position-list li")
    assert positions.locator("b").all_inner_texts() == ["Ann", "Ben", "Cy"]
    assert "“Ann wants it.”" in positions.first.inner_text()
    assert "with mass at most 0.9\N{NO-BREAK SPACE}kg" in positions.first.inner_text()
    for limits, n_beyond in (({"mass": [None, 0.01]}, 3), ({}, 0)):
        reader.set(limits=limits)
        assert reader.page.locator("#position-list .beyond").count() == n_beyond
    # Decided for what Ben holds; Cy agrees nevertheless, Ann dissents.
    reader.click(reader.page.get_by_label("Show: Ben"))
    of_ben = reader.state["chosen"]
    assert reader.state["reason"] == "Ben wants it."
    assert reader.page.get_by_label("Ben agrees").is_checked()
    reader.page.get_by_label("Cy agrees").check()
    reader.click("#decide")
    assert f"for {of_ben} by Ben and Cy. Dissent: Ann." in reader.text("#decided")
    path = reader.save(tmp_path / "all.json")
    decision = Decision.read_json(path)
    assert decision.decided["dissent"] == ["Ann"]
    table = read_table(beams(), decision)
    assert positions_frame(table).set_index("name").loc["Ben", "choice"] == of_ben
    said = ["#regret", *(f"#separation li >> nth={k}" for k in range(3))]
    reader.click("#apart summary")
    assert [reader.text(place) for place in said] == separation_sentences(table)
    # Another choice undoes the decision.
    reader.press("ArrowDown", "c", on=reader.first_row)
    assert reader.state["decided"] is None
    # The rest of a file is taken if it is asked for.
    another = visit(page_file)
    another.page.set_input_files("#file", path)
    another.click("#messages button:text('Take those of the file')")
    taken = {"decided": decision.decided, "chosen": of_ben, "limits": {}}
    assert taken.items() <= another.state.items()
    another.set(positions=[{"name": "Dan", "chosen": "ghost"}])
    assert "Dan wants ghost, which is not among these designs." in another.text("#position-list")


@pytest.mark.slow
def test_a_saved_decision_directs_the_next_tests(visit, tmp_path, said, in_folder, undrawn):
    solve = ["solve", "dtlz2", "--n-obj", "2", "--n-var", "3", "--bounds", "x1=0.1:0.9"]
    said(*solve, "--points", "32", "--study", "s.db")
    said("page", "s.db", "--out", "p.html")
    page = visit(tmp_path / "p.html")
    page.type_limit("f1, at most", "0.8")
    command = page.text("#next code")
    page.save(tmp_path / command.split()[-1])
    said(*shlex.split(command)[1:])
    assert len(read_table("s.db")) == 48


def test_a_saved_page_and_a_link_show_the_state(reader, visit, page_file, tmp_path):
    reader.type_limit("mass [kg], at most", "0.7")
    reader.keep_position("light")
    reader.set(
        limits={"cost, total": [None, 150]},
        chosen=reader.shown[3],
        reason="</script><b>So be it.</b>",
        hidden=["mass"],
    )
    state, shown, address = reader.state, reader.shown, reader.page.url
    assert address.startswith(f"{page_file.as_uri()}#")
    path = reader.save(tmp_path / "saved.html", "#save-page")
    for opened in (address, path.as_uri()):
        reader.page.goto("about:blank")
        reader.open(opened)
        assert (reader.state, reader.shown) == (state, shown)
        assert reader.ask("$('certain').hidden") is False  # cautions are on other limits
    reader.click(reader.page.get_by_label("Show: light"))
    assert reader.state["limits"] == {"mass": [None, 0.7]}
    assert reader.state["chosen"] is None
    reader.page.evaluate("location.hash = '#%7B%22limits%22%3A%7B%7D%7D'")
    reader.until("Object.keys(D.state().limits).length === 0")
    reader.page.evaluate("document.getElementById('reset').click()")
    reader.settle()
    assert reader.state == state
    assert reader.page.url.rstrip("#") == path.as_uri()


def test_relaxing_and_fixed_ranges(reader, tmp_path):
    best = reader.ask("D.data.names[D.verdict.row]")
    mass = beams().set_index("number").loc[best, "mass"]
    reader.type_limit("mass [kg], at most", repr(float(mass) - 1e-3))
    assert f"{best} is proposed" in reader.text("#verdict-words")
    row = reader.page.locator("#relax-list li, #steps-list > div", has_text="mass must be").first
    switched = row.inner_text().replace("\xa0", " ").split(", ")[1].split(" is proposed")[0]
    if row.locator("h3").count():
        switched = row.locator("h3 button").inner_text()
    reader.press("Enter", on=row.get_by_role("button", name="mass must be below"))
    assert reader.ask("D.data.names[D.verdict.row]") == switched
    # Who works by keys stays where the limit was.
    assert reader.ask("document.activeElement.closest('#relax, #steps') !== null")
    reader.type_limit("mass [kg], at most", "")
    # A limit that all others break: the design keeps its limits, and loses its place.
    limit = float(beams()["cost, total"].iloc[reader.ask("[...D.ranking.front]")].quantile(0.9))
    reader.set(limits={"cost, total": [None, limit]}, fixed=True)
    assert reader.ask("D.data.names[D.verdict.row]") == best
    # The commands rank by the same ranges, of the decision and of what is exported.
    asked = Decision.read_json(reader.save(tmp_path / "d.json"))
    reader.export(tmp_path / "e.csv")
    for table in (read_table(beams(), asked), read_table(tmp_path / "e.csv")):
        table = table.take(table.column("mass") >= 0)  # without the prototype
        assert table.feasible_ranking().ideal.tolist() == reader.ask("[...D.ranking.ideal]")
    reader.set(limits={"mass": [None, 0.2], "strength": [-0.4, None]}, chosen=best)
    assert "No design is left" in reader.text("#verdict")
    assert f"{best} is chosen." in reader.text("#verdict")


# Rows


def rows_of(reader):
    """Names of the objectives from the top."""
    return reader.page.locator("#objectives .name b").all_inner_texts()


def test_rows_are_moved_hidden_and_shown_again(reader):
    reader.press("ArrowUp", "ArrowUp", on=reader.page.get_by_label("Move strength"))
    assert rows_of(reader) == ["strength", "mass", "cost, total"]
    assert reader.ask("document.activeElement.ariaLabel") == "Move strength"
    reader.drag("[aria-label='Move strength']", (0.2, 0.2), (0.2, 3))
    assert rows_of(reader) == ["mass", "strength", "cost, total"]
    before = reader.ask("D.verdict.row")
    reader.click(reader.page.get_by_label("Hide mass"))
    assert rows_of(reader) == ["strength", "cost, total"]
    assert reader.ask("D.verdict.row") == before  # it counts as before
    reader.click("#hidden button")
    assert rows_of(reader) == ["mass", "strength", "cost, total"]


@pytest.mark.slow
def test_from_nine_on_rows_are_folded(show):
    frame = pd.DataFrame(np.random.default_rng(4).random((30, 12))).add_prefix("objective ")
    reader = show(decision_page(frame, [*frame]))
    assert rows_of(reader) == [*frame][:8]
    reader.set(limits={"objective 10": [None, 0.9]})
    assert reader.text("#fold") == "Show 4 more, 1 with a limit"
    reader.click("#fold")
    assert rows_of(reader) == [*frame]


def test_axes_over_decades_are_logarithmic(show):
    frame = pd.DataFrame({"life": 10.0 ** np.arange(7), "cost": np.arange(7.0)})
    reader = show(decision_page(frame, Formulation(["life", "cost"], maximize=["life"])))
    middle = "shareOn(scaleOf(D.data.by.get('life')))(1000)"
    assert reader.ask(middle) == pytest.approx(0.5, abs=0.01)
    reader.click("#objectives .sense button")
    assert reader.ask(middle) < 0.05


def test_charts_are_pictures_to_copy(reader):
    """They have their whole legend."""
    reader.set(limits={"mass": [None, 0.8]}, chosen=reader.shown[3])
    reader.page.evaluate(
        """() => {
            navigator.clipboard.write = () => { throw 0 } // then the picture is saved
            window.words = []
            const context = CanvasRenderingContext2D.prototype
            const {fillText} = context
            context.fillText = function (text, ...rest) { words.push(text); fillText.call(this, text, ...rest) }
        }"""
    )
    for part, entries in (
        ("#copy-rows", ("proposed:", "chosen:", "designs that no other dominates")),
        ("#copy-plot", ("proposed", "chosen", "prototype", "dominated by no other")),
    ):
        reader.page.evaluate("words.length = 0; document.getElementById('menu').open = true")
        with reader.page.expect_download() as download:
            reader.click(part)
        assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")
        legend = " ".join(reader.page.evaluate("words"))
        assert [entry for entry in (*entries, "beyond a limit") if entry not in legend] == []


def test_zooming_keeps_what_is_at_the_spot(reader):
    spot = f"D.scatter.spot({reader.ask('D.verdict.row')})"
    before = pytest.approx(reader.ask(spot), abs=1)
    for button in ("Zoom in", "Zoom out"):
        reader.click(reader.page.get_by_label(button))
        assert reader.ask(spot) == before
        assert ("at the edge" in reader.text("#key")) == (button == "Zoom in")
        # Also where another design is looked at.
        assert reader.ask(f"(inspect(D.ranking.front[0]), update(), {spot})") == before


def test_hovering_tells_label_and_values(reader):
    best = reader.ask("D.verdict.row")
    name = reader.ask(f"D.data.names[{best}]")
    reader.page.locator("#scatter-plot .plot").scroll_into_view_if_needed()
    box = reader.page.locator("#scatter-plot .plot").bounding_box()
    x, y = reader.ask(f"D.scatter.spot({best})")
    reader.page.mouse.move(box["x"] + x - 2, box["y"] + y)
    reader.page.mouse.move(box["x"] + x, box["y"] + y)
    reader.settle()
    assert all(text in reader.text("#tip") for text in (name, "mass [kg]"))
    reader.page.mouse.click(box["x"] + x, box["y"] + y)
    reader.settle()
    assert (reader.ask("D.inspected"), reader.state["chosen"]) == (best, None)
    reader.click(reader.page.get_by_label(f"Choose: {name}").first)
    # A reason belongs to its choice: another one has none yet.
    reader.page.keyboard.type("Light.")
    reader.press("Tab")
    assert (reader.state["chosen"], reader.state["reason"]) == (name, "Light.")
    reader.page.locator("#table-body tr").nth(4).click()
    reader.press("c")
    assert (reader.state["chosen"], reader.state["reason"]) == (reader.shown[4], "")
    assert reader.page.evaluate("document.activeElement.id") == "reason"


def test_ticks_are_told_apart_and_say_their_values(reader):
    """Also where values differ far behind the point, or lie over decades."""
    rng = np.random.default_rng(11)
    scales = [{"low": 1e6, "high": 1e6 + 1e-3, "log": False}]
    for _ in range(300):
        low = float(rng.normal() * 10.0 ** rng.integers(-12, 13))
        high = low + abs(low) * float(10.0 ** rng.uniform(-8, 4))
        scales.append({"low": low, "high": high, "log": low > 0 and bool(rng.integers(2))})
    told = reader.page.evaluate("(all) => all.map((s) => tickTexts(s, 5))", scales)
    for scale, ticks in zip(scales, told, strict=True):
        assert 0 < len(ticks) < 21
        for tick in ticks:
            plain = tick["text"].replace("\N{MINUS SIGN}", "-").replace("\xa0", "")
            assert float(plain) == pytest.approx(tick["value"], rel=1e-11, abs=1e-300), (
                scale,
                tick,
            )


# Table and export


def test_export_gives_exactly_what_is_shown(reader, tmp_path):
    """Its cells, and that it comes back with directions, are tested in test_page_logic.py."""
    text = reader.export(tmp_path / "export.csv")
    assert reader.file_name == "Beams_such-shown.csv"
    exported = pd.read_csv(io.StringIO(text), dtype={"number": str})
    assert [*exported] == [
        *("place", "number", "mass [kg]", *OBJECTIVES[1:], "width [mm]", "material", "mark")
    ]
    assert exported["number"].tolist() == reader.shown


def test_the_table_sorts_and_holds_only_rows_in_view(reader):
    frame = beams().set_index(beams()["number"].astype(str))
    heading = reader.page.locator("#table-head button", has_text="mass [kg]")
    for down in (False, True):
        reader.click(heading)
        mass = frame.loc[reader.shown[1:], "mass"].to_numpy()
        assert (np.diff(mass) * (-1 if down else 1) >= 0).all()
    rows = reader.page.locator("#table-body tr")
    assert rows.count() == 16 < len(reader.shown)
    reader.click("#more-rows")
    assert rows.count() == min(64, len(reader.shown))
    reader.press(*["ArrowDown"] * 60, "Enter", on=reader.first_row)
    assert reader.text("h1") == f"Inspected: {reader.shown[60]}"
    assert reader.state["chosen"] is None


def test_a_search_finds_designs_that_are_not_shown(reader, frame):
    row = reader.ask("D.data.whole.pareto.indexOf(0)")
    name = reader.ask(f"D.data.names[{row}]")
    reader.search(name)
    assert "dominated" in reader.text("#table-body tr")
    reader.set(limits={"mass": [None, frame["mass"].iloc[row] - 1e-3]})
    reader.click("#table-body tr")
    assert f"{name} is beyond the limits on mass." in reader.text("#verdict-words")
    for text, fits in (("Steel", frame["material"] == "steel"), ("nobody", frame["mass"] < 0)):
        reader.search(text)
        assert set(reader.shown) - {"prototype"} == labels(frame, np.flatnonzero(fits))


# Everyone


@pytest.mark.slow
def test_the_keyboard_reaches_every_named_control(laid_open):
    wanted = laid_open.page.evaluate(
        """() => { let k = 0
        for (const e of document.querySelectorAll('button, input, select, textarea, summary, [tabindex]'))
            if (!e.disabled && e.tabIndex >= 0 && e.getClientRects().length) e.dataset.stop = k++
        return k }"""
    )
    laid_open.page.evaluate(
        """() => { window.reached = {}; document.addEventListener('focusin', ({target: e}) => {
            reached[e.dataset.stop] ??= e.ariaLabel ?? e.labels?.[0]?.textContent ?? e.textContent }) }"""
    )
    for _ in range(wanted + 5):
        laid_open.page.keyboard.press("Tab")
    names = laid_open.page.evaluate("reached")
    assert len(names) == wanted > 50
    assert all(names.values())


CONTRAST = """() => {
  const rgb = (text) => text.match(/[\\d.]+/g).map(Number)
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0)
  const ratio = (a, b) => { const [x, y] = [light(a), light(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05) }
  const ground = (e) => {
    for (; e; e = e.parentElement) { const c = rgb(getComputedStyle(e).backgroundColor); if (c[3] !== 0) return c }
    return [255, 255, 255] }
  const texts = []
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT)
  while (walk.nextNode()) {
    const e = walk.currentNode.parentElement
    if (!walk.currentNode.data.trim() || e.closest("script, noscript, :disabled") || !e.getClientRects().length) continue
    texts.push([ratio(rgb(getComputedStyle(e).color), ground(e)), walk.currentNode.data.slice(0, 30)])
  }
  const borders = [...document.querySelectorAll("button:enabled, input[type=text], select, textarea")]
    .filter((e) => e.getClientRects().length && parseFloat(getComputedStyle(e).borderTopWidth) > 0)
    .map((e) => [ratio(rgb(getComputedStyle(e).borderTopColor), ground(e.parentElement)), e.id + e.className])
  const marks = Object.entries(LOOKS).map(([key, {colour}]) =>
    [ratio([1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)), [255, 255, 255]), key])
  return {texts, borders, marks}
}"""


def test_contrast(laid_open):
    measured = laid_open.page.evaluate(CONTRAST)
    assert len(measured["texts"]) > 200
    assert [entry for entry in measured["texts"] if entry[0] < 4.5] == []
    assert [entry for entry in measured["borders"] + measured["marks"] if entry[0] < 3] == []
    shapes = laid_open.page.evaluate("Object.values(LOOKS).map((look) => look.shape)")
    assert len(set(shapes)) >= len(shapes) - 1  # of dominated and prototype only size and colour


@pytest.mark.slow
def test_paper_has_one_page_with_the_decision(reader):
    reader.set(
        chosen=reader.shown[2],
        pins=["prototype", *reader.shown[3:5]],
        limits={"mass": [None, 0.8]},
        reason="Light and strong.\nCheap, too.",
        positions=[{"name": f"P{k}", "chosen": reader.shown[k]} for k in range(6)],
        fixed=True,
    )
    reader.page.evaluate("document.querySelector('#further details').open = true")
    reader.page.evaluate("dispatchEvent(new Event('beforeprint'))")
    lanes = "[...document.querySelectorAll('.axis')].filter((one) => one.checkVisibility())"
    assert (
        reader.ask(f"{lanes}.length") == 3
    )  # not of variables: their axes would cover what is below
    sheet = reader.page.pdf(format="A4")
    assert sheet.count(b"/Type /Page\n") == 1 or sheet.count(b"/Type/Page\n") == 1
    reader.page.emulate_media(media="print")
    text = reader.page.inner_text("body")
    chosen = beams().set_index("number").loc[reader.state["chosen"]]
    for told in (
        *("Beams", "mass at most 0.8 kg", "Light and strong.", "better"),
        *("Ranked by fixed ranges", reader.state["chosen"]),
        f"width = {chosen['width']:.2f} mm, material = {chosen['material']}.",
    ):
        assert told in text
    assert reader.page.is_visible("#rows canvas >> nth=0")
    printed = "getComputedStyle(document.querySelector('.bar i')).printColorAdjust"
    assert reader.page.evaluate(printed) == "exact"  # else it is left out
    for control in reader.page.locator("button:not(.label, .link), input, textarea").all():
        assert not control.is_visible()


@pytest.mark.slow
def test_narrow_windows_have_no_controls_outside(reader):
    reader.page.evaluate("document.querySelectorAll('.menu').forEach((one) => { one.open = true })")
    for width in (1100, 760, 390):
        reader.page.set_viewport_size({"width": width, "height": 844})
        reader.settle()
        assert reader.page.evaluate("document.documentElement.scrollWidth") == width
        boxes = reader.page.evaluate(
            """[...document.querySelectorAll("header button, summary, #rows input[type=text], #rows button, .bar select, h1")]
            .filter((e) => e.getClientRects().length).map((e) => { const b = e.getBoundingClientRect(); return [b.left, b.right, e.id] })"""
        )
        assert len(boxes) > 20
        assert reader.page.evaluate(
            "[...document.querySelectorAll('#menu button')].every((e) => e.scrollWidth <= e.clientWidth)"
        )
        for left, right, name in boxes:
            assert -1 <= left < right <= width + 1, name
        for plot in reader.page.locator(".plot").all():
            box = plot.bounding_box()
            assert min(box["height"], box["width"] - 50) > 170


HOSTILE = [
    r"$$\href{javascript:document.title='run'}{a}$$",
    r"\(\require{html}\style{background:url(https://example.org/b)}{b}\)",
    """c"><img src="https://example.org/c" onerror="document.title='run'">""",
    "$$d$$ </script><script>document.title='run'</script>",
]


@pytest.fixture
def attacked(show):
    """A page all of whose names, labels and texts are hostile."""
    frame = pd.DataFrame(np.random.default_rng(1).random((30, 3)), columns=HOSTILE[:3])
    frame[HOSTILE[3]] = [HOSTILE[i % 4] for i in range(30)]
    frame["number"] = [f"{HOSTILE[i % 4]} {i}" for i in range(30)]
    frame = frame.set_index("number").rename_axis(HOSTILE[0] + " label")
    asked = Formulation(HOSTILE[:2], units=dict.fromkeys(HOSTILE, HOSTILE[0]))
    return show(decision_page(read_table(frame, asked, variables=HOSTILE[2:]), title=HOSTILE[2]))


def test_names_are_text(attacked):
    for select in attacked.page.locator("select").all():
        select.select_option(index=select.locator("option").count() - 1)
    attacked.page.mouse.move(700, 500)
    attacked.settle()
    assert (attacked.page.title(), attacked.trouble) == (HOSTILE[2], [])
    assert attacked.page.locator("img, a[href], b b, [onerror]").count() == 0
    attacked.page.evaluate(
        "document.querySelectorAll('details').forEach((one) => { one.open = true })"
    )
    shown = attacked.text("#rows")
    assert all(f"{name} [{HOSTILE[0]}]" in shown for name in HOSTILE[:3])
    assert set(attacked.shown) <= {f"{name} {i}" for name in HOSTILE for i in range(30)}


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
                try {{ {attack} }} catch {{ /* refused at once */ }} }})"""
        )
        assert attacked.page.title() == before
    assert attacked.trouble
    attacked.trouble.clear()  # reports of what was refused


def test_exported_texts_are_no_formulas(show, tmp_path):
    cells = [cell for cell in CELLS if cell != "-"]  # which is no name
    a = np.linspace(-1.5, 2.0, len(cells))
    frame = pd.DataFrame({"-a": a, "b": a[::-1], "note": cells[::-1], "id": cells})
    table = read_table(frame, Formulation(["-a", "b"]), variables=["note"])
    text = show(decision_page(table)).export(tmp_path / "e.csv")
    assert read_table(tmp_path / "e.csv").schema.objectives == ("-a", "b")
    exported = list(csv.DictReader(io.StringIO(text, newline="")))
    assert {float(row["'-a"]) for row in exported} == set(a)
    inert = INERT | {"=1": "'=1"}  # blanks around a text do not count
    for name in ("note", "id"):
        assert {row[name] for row in exported} == {inert[cell.strip()] for cell in cells}


def test_columns_named_as_those_of_an_export_come_back(show, tmp_path):
    """Objectives, notes and labels keep their names, and decisions with them hold."""
    frame = pd.DataFrame(
        {"place": ["A", "B", "C"], "mark": [1, 2, 3], "mark (pymoo-psi)": [3, 2, 0], "mu1": ["u", "v", "w"]}
    )  # fmt: skip
    for formulation in (
        Formulation(["mark", "mark (pymoo-psi)"], maximize=["mark"], units={"mark": "kg"}),
        Formulation(["mark", "mark (pymoo-psi)"], limits={"mark": (None, 2.5)}),
    ):
        table = read_table(frame, formulation)
        text = show(decision_page(table)).export(tmp_path / "e.csv")
        heads = next(csv.reader(io.StringIO(text)))
        assert len({*heads}) == len(heads)
        back = read_table(tmp_path / "e.csv", formulation)
        assert back.schema.objectives == table.schema.objectives
        assert {*back.names} <= {*table.names}
        assert {*back.columns} == {*table.columns}


def fronts(n, m=4):
    """Return n designs on a front, one of them far beyond the others in the last objective."""
    rng = np.random.default_rng(n)
    F = (1.2 - on_sphere(rng, n, m)) ** 1.5
    F[0] = [*F.min(axis=0)[:-1] - 0.01, 1e6]
    frame = pd.DataFrame(F, columns=[f"f{j + 1}" for j in range(m)])
    frame["heat"] = np.where(rng.random(n) < 0.1, np.nan, rng.random(n))
    frame.insert(0, "id", [f"design number {k}" for k in range(n)])
    return frame


OVERLAPS = """({names}) => names.filter((a, k) => names.slice(0, k).some((b) =>
    a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height)).length"""


# Names that are nearer to the point of another design than to their own.
# The text is three pixels inside of its box.
STRAY = """({names, spot}) => names.filter(({row, x, y, width, height}) => {
    const away = (other) => { const [u, v] = spot(other)
        return Math.hypot(Math.max(x - u, 0, u - x - width), Math.max(y + 3 - v, 0, v - y + 3 - height)) }
    return [...decisionPage.ranking.front].some((other) => away(other) < away(row)) }).length"""


@pytest.mark.parametrize("n", [480, *rarely(12, 6000)])
def test_every_design_is_drawn(show, n):
    """What lies beyond an axis, or has no value in it, is counted on the chart."""
    frame = fronts(n)
    reader = show(decision_page(frame, [f"f{j + 1}" for j in range(4)]))
    for name, upper in (("f1", np.inf), ("f1", 0.9), ("f2", 0.4)):
        reader.set(limits={name: [None, upper]} if upper < np.inf else {})
        shown = frame[frame[name] <= upper]
        reader.look_at("Plot, across", "f4")
        assert reader.ask("shownRows.length") == len(shown)
        is_beyond = 0 in shown.index and reader.ask("D.ranking.best[0]") != 0
        assert ("1 at the edge" in reader.text("#key")) == is_beyond
        reader.look_at("Plot, across", "heat")
        if len(shown) == len(frame):
            assert f"{shown['heat'].isna().sum()} design" in reader.text("#key")
    reader.look_at("Plot, up", "heat")  # no column against itself
    assert reader.state["plot"] == ["f2", "heat"]
    # A design that is pinned is inside.
    reader.set(limits={}, pins=["design number 0"])
    assert "at the edge" not in reader.text("#key")


@pytest.mark.parametrize("width", [1440, *rarely(390, 768, 2560)])
def test_names_never_cover_one_another(show, width):
    page = decision_page(fronts(12).drop(columns="heat"), [f"f{j + 1}" for j in range(4)])
    reader = show(page, width=width)
    for part in ("#objectives", "#scatter-plot .plot", "#positions"):
        box = reader.page.locator(part).bounding_box()
        assert width != 1440 or box["y"] + box["height"] <= WINDOW["height"], part
    reader.set(chosen="design number 3", pins=["design number 5"])
    assert reader.page.evaluate(f"({OVERLAPS})(scatter)") == 0
    marks = reader.ask("[3, 5, D.ranking.best[0], ...D.verdict.steps.map((s) => s.row)]")
    assert {*marks} <= {*reader.ask("D.scatter.names.map((name) => name.row)")}
    assert reader.page.evaluate(f"({STRAY})(scatter)") == 0


def test_each_of_a_few_designs_has_its_name(show):
    names = [f"a design with a long name {k}" for k in range(8)]
    frame = fronts(8).drop(columns="heat").assign(id=names)
    reader = show(decision_page(frame, [f"f{j + 1}" for j in range(4)]))
    reader.set(positions=[{"name": f"Person {k}", "chosen": names[k]} for k in range(8)])
    assert reader.ask("D.scatter.names.length") == len(frame)
    assert reader.page.evaluate(f"({OVERLAPS})(scatter)") == 0
    assert reader.page.evaluate(f"({STRAY})(scatter)") == 0


def test_a_german_file_shows_and_accepts_decimal_commas(show, tmp_path):
    text = "Variante;Preis;Masse\nA;4748,36;1,5\nB;3100,5;2,25\nC;12500,25;0,75\n"
    (tmp_path / "d.csv").write_text(text, "utf-8")
    reader = show(
        decision_page(tmp_path / "d.csv", Formulation(["Preis", "Masse"], units={"Masse": "%"}))
    )
    assert "12 500,25" in reader.text("#table-body").replace("\xa0", " ")
    reader.type_limit("Preis, at most", "4 748,36")
    assert reader.state["limits"] == {"Preis": [None, 4748.36]}
    reader.page.locator("#search").focus()
    reader.set(limits={"Preis": [None, 4748.5]})
    assert reader.field("Preis, at most").input_value() == "4748,5"
    reader.type_limit("Preis, at most", "4.748")  # four and a half, or thousands?
    assert reader.state["limits"] == {"Preis": [None, 4748.5]}
    reader.set(limits={})
    reader.click(reader.page.locator("#table-body tr").nth(1))
    assert "Masse 0,75 points" in reader.text(".lead")


def test_a_slider_draws_what_a_new_page_draws(reader):
    """Nothing of a former step stays."""
    pixels = "[...document.querySelectorAll('#rows canvas')].map((canvas) => canvas.toDataURL())"
    limits = ({"width": [4, 18]}, {"mass": [0.2, 0.8]}, {"width": [8, 16]})
    seen = set()
    for limit in limits:
        reader.set(limits=limit)
        drawn = reader.ask(pixels)
        reader.ask("redraw()")
        assert reader.ask(pixels) == drawn
        seen.add(drawn[1])
    assert len(seen) == len(limits)
