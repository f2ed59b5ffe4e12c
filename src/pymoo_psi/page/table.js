// The table of designs: only the rows in view are in the document.

const table = (() => {
  const narrow = matchMedia("(max-width: 600px)") // there values are below the name
  const sizes = () => (narrow.matches ? [50, 620] : [29, 470]) // pixels of a row, and of rows, as in page.css
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
  const columnOf = (column, text, kind) => ({text, kind, width: length(column), order: {by: "column", name: column.name}, cell: (row) => cellText(column, row)})
  const columns = [
    {text: "place", width: 9, order: {by: "distance"}, cell: (row) => placed(row).replace(/^place | the limits$/, ""), kind: ".place"},
    {text: data.label, width: longest(data.names), order: {by: "label"}, cell: called, kind: ".label"},
    ...limitable.map((column) => columnOf(column, column.label, column.texts ? "" : ".number")),
    {text: "most behind the best", width: 7 + longest(data.objectives.map(({name}) => name)), cell: (row) => behindText(data, ranking, row), kind: ".number.hint"},
    ...data.columns.filter(isGeometric).map((column) => columnOf(column, column.name.split(" ")[0], ".number.hint.distance")),
  ]
  // As wide as its texts and the longest word of its head.
  const widths = columns.map(({width, text, kind}) => {
    const gap = kind ? 18 : 32
    const pixels = ceil(max(8.2 * width + gap, min(7.2 * longest(text.split(" ")) + gap + 8, 150), 56))
    return kind === ".label" ? `min(${pixels}px, 26vw)` : `${pixels}px`
  })
  const tracks = widths.map((width, k) => (k ? `minmax(${width}, 1fr)` : width))
  // The distances are the last columns.
  function arrange() {
    const end = $("distances").checked ? Infinity : -3
    for (const [name, first] of [["all", 0], ["values", 2]]) {
      box.style.setProperty(`--${name}`, tracks.slice(first, end).join(" "))
      box.style.setProperty(`--${name}-width`, `calc(${widths.slice(first, end).join(" + ")})`)
    }
    box.classList.toggle("distances", $("distances").checked)
  }
  $("distances").onchange = arrange
  arrange()
  const isSorted = ({order = {}}) => order.by === state.order.by && order.name === state.order.name

  const heads = columns.map((column) => {
    const onclick = () => {
      change({order: {...column.order, down: isSorted(column) && !state.order.down}})
      home()
    }
    const sort = make("button", {title: `Sort by ${column.text}`, onclick, onkeydown: (event) => event.stopPropagation()}, broken(column.text))
    return make(`div.cell${column.kind}`, {role: "columnheader"}, column.order ? sort : make("span", column.text))
  })
  head.append(...heads)

  function line(k) {
    const row = order[k]
    const marks = {row: true, first: ranking.place[row] === 1, hovered: row === hoveredRow, chosen: row === chosenRow(), inspected: row === inspected, cursor: k === cursor, pinned: isPinned(row)}
    const attributes = {id: `row-${k}`, className: Object.keys(marks).filter((mark) => marks[mark]).join(" "), role: "row",
      ariaRowIndex: k + 2, ariaSelected: marks.chosen, style: `top: ${k * sizes()[0]}px`}
    return make("div", attributes, columns.map(({cell, kind}, j) =>
      make(`div.cell${kind}`, {role: "gridcell"}, j === 0 && icon(LOOKS[look(row)]), j === 1 ? ended(cell(row)) : cell(row))))
  }

  function draw() {
    cursor = max(0, min(cursor, order.length - 1))
    const [height, seen] = sizes()
    body.style.height = `${order.length * height}px`
    const first = max(0, min(order.length, floor(top / height)) - 2)
    const last = min(order.length, ceil((top + seen) / height))
    renew(body, [...upTo(max(0, last - first))].map((k) => line(first + k)))
    box.ariaRowCount = order.length + 1
    box.setAttribute("aria-activedescendant", order.length ? `row-${cursor}` : "")
    columns.forEach((column, k) => {
      heads[k].ariaSort = !isSorted(column) ? "none" : state.order.down ? "descending" : "ascending"
    })
    for (const id of ["choose", "pin"]) show(id, inspected >= 0)
  }

  // The cursor is kept in view.
  function go(k) {
    cursor = max(0, min(order.length - 1, k))
    const [height] = sizes()
    const place = cursor * height
    box.scrollTop = min(place, max(top, place - box.clientHeight + head.offsetHeight + height))
    scrolled()
  }
  function scrolled() {
    top = box.scrollTop
    draw()
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
  narrow.onchange = draw
  return {show: draw, home}
})()

function showOrder() {
  renew("export", `${exact(order.length)} shown as CSV`)
  $("export").disabled = order.length === 0
  renew("shown", `${exact(order.length)} ${$("search").value ? "found" : "shown"}`)
  const count = ranking.rows.length - ranking.front.length
  show("more-designs", count)
  renew("dominated", `${state.dominated ? "hide" : "show"} ${exact(count)} dominated`)
}

onClicks({choose: () => choose(inspected), pin: () => pin(inspected), dominated: () => change({dominated: !state.dominated})})
$("search").oninput = () => {
  table.home()
  soon()
}
