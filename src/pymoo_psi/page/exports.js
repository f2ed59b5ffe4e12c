// Designs as a table for spreadsheets and the commands.

// A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left alone.
const inert = (text) =>
  /^'*(?![+-]?([\d.,]*(e[+-]?\d+)?%?|inf|infinity|nan)$)[=+\-@＝＋－＠\t\r\n]/i.test(text)
    ? `'${text}` : text

// The columns of an export as CSVW describes them; the heading is with the unit, unless another column is called so.
function exported(data) {
  const own = (name) => (name === "place" ? "place (text)" : name)
  const columns = [
    ["place", "integer"],
    [own(data.label), data.labels.every(Number.isInteger) ? "integer" : "string"],
    ...data.columns.map(({role, field, name, label, texts, unit}) => [
      role === "geometric" ? field : data.by.has(label) ? own(name) : label, texts ? "string" : "number", unit || undefined]),
    ["mark", "string"],
  ]
  return columns.map(([heading, datatype, unit]) => ({titles: inert(heading), datatype, "schema:unitText": unit}))
}

// Rows as CSV, every digit of the numbers, with places under the limits.
function csv(data, rows, ranking) {
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
  const text = (value) => (Number.isNaN(value) ? "" : quoted(inert(String(value))))
  const cells = data.columns.map((column) => {
    const array = valuesOf(ranking, column)
    return column.texts ? (i) => text(column.texts[array[i]]) : (i) => text(array[i])
  })
  const lines = [...rows].map((i) => [ranking.place[i] || "", text(data.labels[i]), ...cells.map((cell) => cell(i)),
    placeText(data, ranking, i)].join(","))
  // With the mark by which spreadsheets know UTF-8.
  return `\ufeff${exported(data).map(({titles}) => quoted(titles)).join(",")}\n${lines.join("\n")}\n`
}

// What the columns of the CSV are and what is chosen, so that it comes back with its objectives,
// directions and units: CSVW with an entry of our own, as read_table has it.
function metadata(data, rows, state, name) {
  const chosen = state.chosen === null ? {} : {chosen: state.chosen, reason: state.reason}
  return `${JSON.stringify({
    "@context": "http://www.w3.org/ns/csvw",
    url: encodeURIComponent(name),
    dialect: {commentPrefix: null},
    "pymoo-psi:rows": rows.length,
    "pymoo-psi:head": {...data.head, ranges: rangesOf(data, state), ...chosen},
    tableSchema: {columns: exported(data)},
  }, null, 1)}\n`
}
