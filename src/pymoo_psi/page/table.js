// The table of designs: the first ones in their order, and more where they are asked for.

let mostRows = 16
const tableColumns = [
  {text: "place", kind: ".place", name: null, cell: (row) => [icon(LOOKS[look(row)]), placed(row).replace(/^place | the limits$/, "")]},
  {text: data.label, kind: ".label", name: data.label, cell: (row) => [inspectButton(row), inspected === row && make("span.buttons", chooseButton(row), pinButton(row))]},
  ...data.columns.map((column) => (
    {text: column.label, kind: column.texts ? "" : ".number", name: column.name, cell: (row) => cellText(column, row)})),
  {text: "most behind the best", kind: ".number.hint.most", cell: (row) => behindText(ranking, row)},
]
$("table").style.setProperty("--values", min(data.textual.length ? 5 : 6, data.columns.length)) // side by side on a narrow screen
const isSorted = ({name}) => name === state.sorted

function sortBy(column) {
  change({sorted: column.name, down: isSorted(column) && !state.down})
  $("table").scrollTop = 0
}

function showTable() {
  const direction = state.down ? "descending" : "ascending"
  renew("table-head", make("tr", tableColumns.map((column) => make(`th${column.kind}`, {scope: "col", ariaSort: isSorted(column) ? direction : "none"},
    column.name !== undefined ? button(column.text, () => sortBy(column)) : column.text))))
  renew("table-body", Array.from(order.subarray(0, mostRows), (row) => {
    const marks = [ranking.place[row] === 1 && "first", row === chosenRow() && "chosen", row === inspected && "inspected", isPinned(row) && "pinned"]
    return make("tr", {className: marks.filter(Boolean).join(" ")},
      tableColumns.map(({kind, cell}) => make(`td${kind}`, cell(row))))
  }))
  markInTable()
  const further = order.length - mostRows
  renew("more-rows", further > 0 && `Show ${exact(min(further, 3 * mostRows))} more`)
  $("export").disabled = !order.length
  renew("shown", counted(order.length, "design"))
  const count = ranking.rows.length - ranking.front.length
  renew("dominated", count && `${state.dominated ? "hide" : "show"} ${exact(count)} dominated`)
}

function markInTable() {
  for (const line of $("table-body").rows) line.classList.toggle("hovered", order[line.sectionRowIndex] === hoveredRow)
}

// The place of the line that a key or a click is meant for.
const lineOf = (element) => element.closest("#table-body tr")?.sectionRowIndex ?? -1
const focusedRow = () => order[lineOf(document.activeElement)] ?? -1
const toLine = (by) => () => $("table-body").rows[lineOf(document.activeElement) + by]?.querySelector("button").focus()
onKeys($("table"), {arrowdown: toLine(1), arrowup: toLine(-1), c: () => choose(focusedRow()), p: () => pin(focusedRow()), escape: () => inspect(-1)})
$("table-body").onclick = ({target}) => {
  if (target.closest("button")) return
  target.closest("tr").querySelector("button").focus()
  inspect(focusedRow())
}

onClicks({
  "more-rows": () => {
    mostRows *= 4
    soon()
  },
  dominated: () => change({dominated: !state.dominated}),
})
$("search").oninput = () => {
  $("table").scrollTop = 0
  soon()
}
