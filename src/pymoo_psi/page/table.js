// The table of designs: only the rows in view are in the document.

const table = (() => {
  const HEIGHT = 29
  const box = $("table")
  const head = make("div.head", {role: "row"})
  const body = make("div.body", {role: "rowgroup"})
  box.append(head, body)
  let cursor = 0
  // The height is kept: asking after changes would make the browser lay out the page at every step.
  const view = {top: 0, height: box.clientHeight}
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
  box.style.setProperty("--columns", widths.join(" "))
  head.style.width = body.style.width = `calc(${widths.join(" + ")})`
  const isSorted = ({order}) => order.by === state.order.by && order.name === state.order.name

  const heads = columns.map((column) => {
    const head = make("button", {title: `Sort by ${column.text}`}, broken(column.text))
    head.onclick = () => {
      change({order: {...column.order, down: isSorted(column) && !state.order.down}})
      home()
    }
    head.onkeydown = (event) => event.stopPropagation()
    return make(`div.cell${column.kind}`, {role: "columnheader"}, head)
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
    body.style.minHeight = `${min(data.total, 17) * HEIGHT}px` // as high as the box, or all rows, at any limit
    const first = max(0, min(order.length, floor(view.top / HEIGHT)) - 2)
    const last = min(order.length, ceil((view.top + view.height) / HEIGHT))
    renew(body, Array.from({length: max(0, last - first)}, (_, k) => line(first + k)))
    box.ariaRowCount = order.length + 1
    box.setAttribute("aria-activedescendant", order.length ? `row-${cursor}` : "")
    columns.forEach((column, k) => {
      heads[k].ariaSort = !isSorted(column) ? "none" : state.order.down ? "descending" : "ascending"
    })
    for (const id of ["choose", "pin"]) $(id).disabled = current() < 0
  }

  function go(k) {
    cursor = max(0, min(order.length - 1, k))
    const top = cursor * HEIGHT
    const room = box.clientHeight - head.offsetHeight - HEIGHT
    if (top < view.top) box.scrollTop = top
    else if (top > view.top + room) box.scrollTop = top - room
    view.top = box.scrollTop
    show()
  }

  const home = () => { box.scrollTop = cursor = 0 }
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
  box.onscroll = () => { // once a frame
    view.top = box.scrollTop
    show()
  }
  new ResizeObserver(() => {
    view.height = box.clientHeight
    if (order) show()
  }).observe(box)
  return {show, home, current}
})()

function showOrder() {
  renew("export", `${exact(order.length)} shown as CSV`)
  $("export").disabled = order.length === 0
  renew("shown", `${exact(order.length)} ${$("search").value ? "found" : "shown"}`)
}

function buildTable() {
  onClicks({choose: () => choose(table.current()), pin: () => pin(table.current())})
  $("search").oninput = () => {
    table.home()
    soon()
  }
  following.push(showOrder, table.show)
}
