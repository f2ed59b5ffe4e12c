// The table of designs: only the rows in view are in the document.

const table = (() => {
  const [HEIGHT, SEEN] = [29, 470] // of a row, and of rows, as in page.css
  const box = $("table")
  const [head, body] = box.children
  let cursor = 0
  let top = 0 // how far it is scrolled: asking would make the browser lay out the page at every step
  // As wide as the longest text: of numbers those at the ends of the range have it.
  const longest = (texts) => texts.reduce((most, text) => max(most, text.length), 1)
  const length = (column) => column.texts ? longest(column.texts) : isGeometric(column) ? 9
    : longest([1, -1].map((sign) => valueText(column, endOf(column.values, sign))))
  // A name of which, where it is too long, the end stays: it is what tells such names apart.
  const ended = (name) => name.match(/^(.*?)(.{0,12})$/su).slice(1).map((part) => make("span", part))
  const columns = [
    {text: data.label, width: longest(data.names), order: {by: "label"}, cell: called, kind: ".label"},
    {text: "place", width: 10, order: {by: "distance"}, cell: (row) => placed(row).replace("place ", ""), kind: ""},
    ...[...limitable, ...data.columns.filter(isGeometric)].map((column) => ({
      text: isGeometric(column) ? column.name.split(" ")[0] : column.label, width: length(column), order: {by: "column", name: column.name},
      cell: (row) => cellText(column, row), kind: column.texts ? "" : isGeometric(column) ? ".number.hint" : ".number"})),
  ]
  const pixels = columns.map(({width, text}) => ceil(max(7.4 * width + 22, min(7.2 * text.length + 34, 150), 62)))
  const widths = pixels.map((width, j) => (j ? `${width}px` : `min(${width}px, 55vw)`))
  box.style.setProperty("--columns", widths.map((width) => `minmax(${width}, 1fr)`).join(" "))
  head.style.width = body.style.width = `calc(${widths.join(" + ")})`
  const isSorted = ({order}) => order.by === state.order.by && order.name === state.order.name

  const heads = columns.map((column) => {
    const onclick = () => {
      change({order: {...column.order, down: isSorted(column) && !state.order.down}})
      home()
    }
    const sort = make("button", {title: `Sort by ${column.text}`, onclick, onkeydown: (event) => event.stopPropagation()}, broken(column.text))
    return make(`div.cell${column.kind}`, {role: "columnheader"}, sort)
  })
  head.append(...heads)

  function line(k) {
    const row = order[k]
    const marks = {row: true, first: ranking.place[row] === 1, hovered: row === hoveredRow, chosen: row === chosenRow(), inspected: row === inspected, cursor: k === cursor, pinned: isPinned(row)}
    const attributes = {id: `row-${k}`, className: Object.keys(marks).filter((mark) => marks[mark]).join(" "), role: "row",
      ariaRowIndex: k + 2, ariaSelected: marks.chosen, style: `top: ${k * HEIGHT}px`}
    return make("div", attributes, columns.map(({cell, kind}, j) =>
      make(`div.cell${kind}`, {role: "gridcell"}, j === 1 && icon(LOOKS[look(row)]), j ? cell(row) : ended(cell(row)))))
  }

  function show() {
    cursor = max(0, min(cursor, order.length - 1))
    body.style.height = `${order.length * HEIGHT}px`
    const first = max(0, min(order.length, floor(top / HEIGHT)) - 2)
    const last = min(order.length, ceil((top + SEEN) / HEIGHT))
    renew(body, [...upTo(max(0, last - first))].map((k) => line(first + k)))
    box.ariaRowCount = order.length + 1
    box.setAttribute("aria-activedescendant", order.length ? `row-${cursor}` : "")
    columns.forEach((column, k) => {
      heads[k].ariaSort = !isSorted(column) ? "none" : state.order.down ? "descending" : "ascending"
    })
    for (const id of ["choose", "pin"]) $(id).disabled = current() < 0
  }

  // The cursor is kept in view.
  function go(k) {
    cursor = max(0, min(order.length - 1, k))
    const place = cursor * HEIGHT
    box.scrollTop = min(place, max(top, place - box.clientHeight + head.offsetHeight + HEIGHT))
    scrolled()
  }
  function scrolled() {
    top = box.scrollTop
    show()
  }

  function home() {
    cursor = 0
    box.scrollTop = 0
  }
  const current = () => order[cursor] ?? -1

  onKeys(box, {
    arrowdown: () => go(cursor + 1), arrowup: () => go(cursor - 1), pagedown: () => go(cursor + 15),
    pageup: () => go(cursor - 15), home: () => go(0), end: () => go(order.length - 1),
    enter: () => inspect(current()), c: () => choose(current()), p: () => pin(current()), escape: () => inspect(-1),
  })
  const rowBelow = ({target}) => target.closest(".row")?.ariaRowIndex - 2 // NaN between the rows
  body.onclick = (event) => {
    if (!(rowBelow(event) >= 0)) return
    go(rowBelow(event))
    inspect(current())
  }
  body.onpointermove = (event) => mark(order[rowBelow(event)] ?? -1)
  body.onpointerleave = () => mark(-1)
  box.onscroll = scrolled // once a frame
  return {show, home, current}
})()

function showOrder() {
  renew("export", `${exact(order.length)} shown as CSV`)
  $("export").disabled = order.length === 0
  renew("shown", `${exact(order.length)} ${$("search").value ? "found" : "shown"}`)
}

onClicks({choose: () => choose(table.current()), pin: () => pin(table.current())})
$("search").oninput = () => {
  table.home()
  soon()
}
