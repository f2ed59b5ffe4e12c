// What all charts show: which designs, in which colours, and what is marked.

let shownRows = [] // the designs that charts show
let marks = [] // {row, look} of those that are drawn large above all
let hoveredRow = -1

function markDesigns() {
  const rows = {prototype: [...data.prototypes], compared: state.pins.map(rowOf), proposed: [proposedRow()], chosen: [chosenRow()], inspected: [inspected]}
  marks = entriesOf(rows).flatMap(([look, some]) => some.map((row) => ({row, look}))).filter(({row}) => row >= 0)
  marked = rowsOf(marks)
  shownRows = state.dominated ? ranking.rows : ranking.front
  scales = new Map()
}

let formerEnds // of the axes; undefined where everything is to be drawn anew
function showCharts() {
  const ends = JSON.stringify(data.columns.map(scaleOf))
  for (const chart of [axes, scatter]) chart.draw(ends !== formerEnds)
  formerEnds = ends
}

// A legend: icons, a text, and whether only a picture to copy has the entry.
const legend = (id, entries) => renew(id, entries.filter(Boolean).map(([icons, text, isPictured]) =>
  make(isPictured ? "li.pictured" : "li", icons, text)))
const legendOfMarks = () => [...Map.groupBy(marks, ({look}) => look)].map(([look, some]) =>
  [icon(LOOKS[look]), some.length > MOST_PINS ? look : `${look}: ${listed(rowsOf(some).map(called))}`, look === "proposed"])
const DENSITY = "; darker: more of them"

// A design under the pointer is marked in all charts and in the table.
function mark(row) {
  if (row === hoveredRow) return
  hoveredRow = row
  for (const chart of [axes, scatter]) chart.mark(row)
  markInTable()
}

function hover(row, x, y) {
  const tip = $("tip")
  mark(row)
  tip.hidden = row < 0
  if (tip.hidden) return
  tip.replaceChildren(make("strong", called(row)), ` ${placed(row)}`, make("table", data.columns.slice(0, 16).map((column) =>
    make("tr", make("td", column.label), make("td.number", cellText(column, row))))))
  const width = tip.offsetWidth
  tip.style.left = `${max(4, x + 16 + width > innerWidth ? x - width - 12 : x + 16)}px`
  tip.style.top = `${max(4, min(y + 12, innerHeight - tip.offsetHeight - 6))}px`
}

// A click inspects, and the pointer marks what is below it.
function listenTo(element, rowAt) {
  const isControl = ({target}) => target.matches("input")
  const at = (event) => isControl(event) ? -1 : rowAt(event.offsetX, event.offsetY)
  element.onclick = (event) => { if (!isControl(event)) inspect(at(event)) }
  element.onpointermove = (event) => { if (!event.buttons) hover(at(event), event.clientX, event.clientY) }
  element.onpointerleave = () => hover(-1)
}

// So does a design that is named or in the table, by the pointer or a key.
function pointed({target}) {
  const link = target.closest("button.link[value]") ?? target.closest("#table-body tr")?.querySelector(".link")
  if (!target.closest(".plot, .axis")) mark(link ? Number(link.value) : -1)
}
for (const type of ["focusin", "pointerover"]) $("page").addEventListener(type, pointed)
