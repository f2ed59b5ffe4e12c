// What all charts show: which designs, in which colours, and what is marked.

let columnsShown = null // the columns of the axes, top down; null where they have to be found again
let shownRows = [] // the designs that charts show
let marks = [] // {row, look} of those that are drawn large above all
let hues = null // row -> look by a category; null for those of the places
let isShaded = false // whether hues show what was computed when the page was made
let hoveredRow = -1
const plots = [] // the scatter plots

function markDesigns() {
  marks = [...data.prototypes].map((row) => ({row, look: "prototype"}))
  for (const name of state.pins) marks.push({row: rowOf(name), look: "pinned"})
  if (ranking.count) marks.push({row: proposedRow(), look: "best"})
  if (chosenRow() >= 0) marks.push({row: chosenRow(), look: "chosen"})
  if (inspected >= 0) marks.push({row: inspected, look: "inspected"})
  marked = marks.map(({row}) => row)
  shownRows = state.dominated ? ranking.rows : ranking.front
  scales = new Map()
}

let formerEnds = ""
function showCharts(everything) {
  const ends = JSON.stringify(limitable.map(scaleOf))
  for (const chart of [axes, ...plots]) chart.draw(everything || ends !== formerEnds)
  formerEnds = ends
  const looks = new Set(marks.map(({look}) => look))
  renew("key", ["chosen", "pinned", "prototype"].filter((look) => looks.has(look)).flatMap((look) => [icon(LOOKS[look]), `${look} `]))
}

// A design under the pointer is marked in all charts and in the table.
function mark(row) {
  if (row === hoveredRow) return
  hoveredRow = row
  for (const chart of [axes, ...plots]) chart.mark(row)
  table.show()
}

function hover(row, x, y) {
  const tip = $("tip")
  mark(row)
  tip.hidden = row < 0
  if (tip.hidden) return
  tip.replaceChildren(make("strong", called(row)), ` ${placed(row)}`, make("table", limitable.slice(0, 16).map((column) =>
    make("tr", make("td", column.label), make("td.number", cellText(column, row))))))
  const [width, height] = [tip.offsetWidth, tip.offsetHeight]
  tip.style.left = `${max(4, x + 16 + width > innerWidth ? x - width - 12 : x + 16)}px`
  tip.style.top = `${max(4, min(y + 12, innerHeight - height - 6))}px`
}

// A drag over a chart sets limits, a click inspects, and the pointer marks what is below it.
//   limits(x, y, u, v)  those of a drag from one place to another, [[column, limit], …]
function listenTo(element, rowAt, limits) {
  onDrag(element, (x, y, {target}) => target.matches("input") ? null : {
    move: (u, v) => setLimits(limits(x, y, u, v), false),
    up: (u, v, moved) => (moved ? setLimits(limits(x, y, u, v)) : inspect(rowAt(u, v))),
  })
  element.addEventListener("pointermove", (event) => { // a drag takes onpointermove
    if (!event.buttons) hover(event.target.matches("input") ? -1 : rowAt(event.offsetX, event.offsetY), event.clientX, event.clientY)
  })
  element.onpointerleave = () => hover(-1)
}

const colourings = [...data.columns, ...data.shades].filter(({looks}) => looks)
$("colour").append(make("option", "place"), ...colourings.map(({label}) => make("option", label)))
$("colour").parentElement.hidden = !colourings.length
$("colour").onchange = () => {
  const column = colourings[$("colour").selectedIndex - 1]
  const lookOf = (place) => column.looks[place % column.looks.length] // texts may have come since
  isShaded = data.shades.includes(column)
  hues = column ? (row) => lookOf(column.values[row]) : null
  show("colours", column)
  renew("colours", column?.texts.map((text, k) => make("span.key", icon(lookOf(k)), text || "(missing)")))
  soon()
}
