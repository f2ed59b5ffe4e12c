// The logic of the decision page. Bokeh calls this once, when everything is drawn, with
//   source    all designs, one row each, the best last;
//   shown     the filter through which every plot and the table look at them;
//   limits    [{field, slider}] of the criteria;
//   plots     [{name, plot, renderer}], the scatter plots;
//   lines     one row per line of the parallel coordinates; ends: the values at its axes' ends;
//   columns   [{field, name, maximize, notation}]; parallel: fields with an axis;
//   texts     the label of each field as a text that is never TeX;
//   table, names {label, file}; head: what stands above the CSV, {} for nothing.
const PROTOTYPE = 7
const data = source.data
const n = data.group.length
const $ = (id) => document.getElementById(id)
const boxes = [...document.querySelectorAll("#ranks input")]
const selects = [...document.querySelectorAll("select[data-plot]")]
const column = Object.fromEntries(columns.map((c) => [c.field, c]))
const number = (count) => String(count).replace(/\B(?=(\d{3})+$)/g, "\u202f")
const written = ({notation: [kind, digits]}, value) =>
  kind === "fixed" ? value.toFixed(digits) : value.toExponential(digits)

let kept = null // the rows "Keep selected" has left, as a Set; null for all

const switched_on = () =>
  new Set([PROTOTYPE, ...boxes.filter((box) => box.checked).map((box) => Number(box.value))])

// The rows that pass ranks, limits and "Keep selected", in the order of the source. A slider's end
// that stands at the end of its track limits nothing.
function remaining(groups) {
  const bounds = limits.map(({field, slider}) => {
    const [low, high] = slider.value
    return [data[field], low <= slider.start ? -Infinity : low, high >= slider.end ? Infinity : high]
  })
  const rows = []
  for (let i = 0; i < n; i++) {
    const passes = (kept === null || kept.has(i))
      && bounds.every(([values, low, high]) => low <= values[i] && values[i] <= high)
    if (groups.has(data.group[i]) && (passes || data.group[i] === PROTOTYPE)) rows.push(i)
  }
  return rows
}

const is_set = ({slider}) => slider.value[0] > slider.start || slider.value[1] < slider.end

function update() {
  const rows = remaining(switched_on())
  shown.indices = rows
  const left = new Set(rows)
  const selected = source.selected.indices.filter((i) => left.has(i))
  if (selected.length !== source.selected.indices.length) source.selected.indices = selected
  draw_lines(rows)
  for (const {field, slider} of limits) {
    const ends = slider.value.map((value) => written(column[field], value))
    document.querySelector(`[data-limit="${field}"]`).textContent = ends.join(" … ")
  }
  report()
}

// Parallel coordinates, every axis from the least to the greatest value left. Criteria get better
// downwards, also those to be maximised.
function draw_lines(rows) {
  const axes = parallel.map((field) => {
    const known = rows.map((i) => data[field][i]).filter((value) => !isNaN(value))
    const low = known.reduce((a, b) => Math.min(a, b), Infinity)
    const high = known.reduce((a, b) => Math.max(a, b), -Infinity)
    return {values: data[field], low, span: high - low, flip: column[field].maximize, field}
  })
  const place = ({values, low, span, flip}, i) => {
    const share = span > 0 ? (values[i] - low) / span : 0.5
    return flip ? 1 - share : share
  }
  const end = (top) => axes.map(({low, span, flip, field}) =>
    rows.length === 0 || !isFinite(low) ? "" : written(column[field], top !== flip ? low + span : low))
  const steps = axes.map((_, j) => j)
  ends.data = {x: steps, low: end(false), high: end(true)}
  const faint = Math.min(0.7, Math.max(0.06, 40 / rows.length)) // many lines are a cloud
  drawing = true
  lines.selected.indices = []
  lines.data = {
    xs: rows.map(() => steps),
    ys: rows.map((i) => axes.map((axis) => place(axis, i))),
    colour: rows.map((i) => data.colour[i]),
    alpha: rows.map((i) => (data.group[i] > 0 ? 0.8 : faint)),
    width: rows.map((i) => (data.group[i] > 5 ? 2.5 : 1.2)),
    label: rows.map((i) => data.label[i]),
    row: rows,
  }
  drawing = false
  select_lines()
}

// Selections of the designs and of the lines follow each other, but while the lines are replaced.
let drawing = false
const same = (a, b) => a.length === b.length && a.every((value, k) => value === b[k])

function select_lines() {
  const chosen = new Set(source.selected.indices)
  const indices = [...lines.data.row.keys()].filter((k) => chosen.has(lines.data.row[k]))
  if (!same(indices, lines.selected.indices)) lines.selected.indices = indices
}

function select_designs() {
  if (drawing) return
  const rows = lines.selected.indices.map((k) => lines.data.row[k])
  const chosen = new Set(rows)
  if (source.selected.indices.length !== rows.length
      || !source.selected.indices.every((i) => chosen.has(i))) source.selected.indices = rows
}

function report() {
  const designs = (rows) => rows.filter((i) => data.group[i] !== PROTOTYPE).length
  const left = designs(shown.indices)
  const total = n - data.group.filter((group) => group === PROTOTYPE).length
  const selected = source.selected.indices.length
  const changed = kept !== null || boxes.some((box) => box.checked !== box.defaultChecked)
    || limits.some(is_set)
  $("count").textContent = left === 0 ? `No design is left: ${remedy()}`
    : `${number(left)} of ${number(total)} designs`
  $("count").classList.toggle("none", left === 0)
  $("selected").textContent = selected > 0 ? `${number(selected)} selected` : ""
  $("keep").disabled = $("clear").disabled = selected === 0
  $("reset").disabled = !changed && selected === 0
  const count = selected || shown.indices.length
  $("export").textContent = `Export ${number(count)} ${selected ? "selected" : "shown"} as CSV`
  $("export").disabled = count === 0
  $("fit").disabled = shown.indices.length === 0
  const optima = new Set(shown.indices.filter((i) => data.mark[i] === "Salukvadze optimum"))
  $("hidden").textContent = optima.size === 0 ? " (not among them)" : ""
}

// What to do where nothing is left: other ranks may have designs within the limits.
function remedy() {
  const others = remaining(new Set(data.group)).filter((i) => data.group[i] !== PROTOTYPE)
  if (others.length > 0) return "switch on more ranks"
  return kept === null ? "widen the limits" : "widen the limits, or reset"
}

// The range of a column over rows.
function extent(field, rows) {
  let [low, high] = [Infinity, -Infinity]
  for (const i of rows) {
    const value = data[field][i]
    if (!isNaN(value)) {
      low = Math.min(low, value)
      high = Math.max(high, value)
    }
  }
  return low <= high ? [low, high] : [0, 1]
}

// The designs of the ranks switched on: limits leave the axes be until they are fitted.
function of_ranks() {
  const groups = switched_on()
  return [...data.group.keys()].filter((i) => groups.has(data.group[i]))
}

// Put a column on an axis of a scatter plot, the range a little wider than its values in rows.
function set_axis(select, rows) {
  const {plot, renderer} = plots.find(({name}) => name === select.dataset.plot)
  const {dataset: {axis}, value: field} = select
  const [low, high] = extent(field, rows)
  const margin = high > low ? 0.05 * (high - low) : 0.05 * Math.abs(high) || 1
  const range = axis === "x" ? plot.x_range : plot.y_range
  const [start, end] = [low - margin, high + margin]
  range.setv({start, end, reset_start: start, reset_end: end})
  plot[axis === "x" ? "below" : "left"][0].axis_label = texts[field]
  for (const glyph of [renderer.glyph, renderer.nonselection_glyph]) glyph[axis] = {field}
}

function set_axes(rows) {
  for (const select of selects) set_axis(select, rows)
}

// The rows to export in the order of the table: the selected ones if there are any.
function rows_to_export() {
  const order = Bokeh.index.get_by_id(table.id)?.data.index ?? shown.indices
  const chosen = new Set(source.selected.indices)
  return chosen.size > 0 ? order.filter((i) => chosen.has(i)) : [...order]
}

// A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left alone,
// also those written with a comma, a percent sign or an exponent. The command writes CSV likewise.
const inert = (text) =>
  /^[=+\-@\t\r]/.test(text) && !/^[+-]?[\d.,]*(e[+-]?\d+)?%?$/i.test(text) ? `'${text}` : text

// The head of the CSV, its names written as in the header.
const named = (value) => Array.isArray(value) ? value.map(inert)
  : typeof value !== "object" ? value
  : Object.fromEntries(Object.entries(value).map(([name, inner]) => [inert(name), named(inner)]))

function csv(rows) {
  const quoted = (cell) => (/[",\r\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell)
  const text = (value) => (Number.isNaN(value) ? "" : quoted(inert(String(value))))
  const fields = [["label", names.label], ...columns.map(({field, name}) => [field, name]),
    ["rank", "rank"], ["mark", "mark"]]
  const cell = (field, i) => (field === "rank" && data.rank[i] < 0 ? "" : text(data[field][i]))
  const header = fields.map(([, name]) => quoted(inert(name)))
  const comment = Object.keys(head).length === 0 ? "" : `# ${JSON.stringify(named(head))}\n`
  const body = rows.map((i) => fields.map(([field]) => cell(field, i)))
  return comment + [header, ...body].map((row) => row.join(",") + "\n").join("")
}

function save() {
  const link = document.createElement("a")
  link.href = URL.createObjectURL(new Blob([csv(rows_to_export())], {type: "text/csv"}))
  const what = source.selected.indices.length > 0 ? "selected" : "shown"
  link.download = `${names.file}-${what}.csv`
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10000)
}

function reset() {
  kept = null
  for (const box of boxes) box.checked = box.defaultChecked
  for (const {slider} of limits) slider.value = [slider.start, slider.end]
  source.selected.indices = []
  set_axes(of_ranks())
  update()
}

// The best first in the table, as if its headings had been clicked.
function sort_table() {
  const view = Bokeh.index.get_by_id(table.id)
  const of = (field) => view.grid.getColumns().find((c) => c.field === field).id
  view.grid.setSortColumns([{columnId: of("group"), sortAsc: false}, {columnId: of("mu1"), sortAsc: true}])
  view.updateGrid()
}

let waiting = false // several changes before the next frame are one update
function update_soon() {
  if (waiting) return
  waiting = true
  requestAnimationFrame(() => { waiting = false; update() })
}

for (const {slider} of limits) slider.properties.value.change.connect(update_soon)
for (const box of boxes) box.addEventListener("change", () => {
  set_axes(of_ranks())
  update_soon()
})
for (const select of selects) select.addEventListener("change", () => set_axis(select, of_ranks()))
set_axes(of_ranks())
source.selected.properties.indices.change.connect(() => { select_lines(); report() })
lines.selected.properties.indices.change.connect(select_designs)
$("keep").addEventListener("click", () => {
  kept = new Set(source.selected.indices)
  source.selected.indices = []
  update()
})
$("clear").addEventListener("click", () => { source.selected.indices = [] })
$("reset").addEventListener("click", reset)
$("fit").addEventListener("click", () => set_axes(shown.indices))
$("export").addEventListener("click", save)
sort_table()
update()
if (limits.some(is_set)) set_axes(shown.indices) // limits that the page opens with
document.body.dataset.ready = "yes"
