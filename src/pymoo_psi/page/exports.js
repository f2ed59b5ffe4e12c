// Designs as a table for spreadsheets and the commands.

// A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left alone.
const inert = (text) =>
  /^'*(?![+-]?([\d.,]*(e[+-]?\d+)?%?|inf|infinity|nan)$)[=+\-@＝＋－＠\t\r\n]/i.test(text)
    ? `'${text}` : text

// The columns of an export as CSVW describes them.
const described = () => data.export.columns.map((column) => ({...column, titles: inert(column.titles)}))

// Rows as CSV, every digit of the numbers, with places under the limits.
function csv(rows, ranking) {
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
  const text = (value) => (Number.isNaN(value) ? "" : quoted(inert(String(value))))
  const cells = data.columns.map(({texts, values}) => (i) => text(texts ? texts[values[i]] : values[i]))
  const lines = [...rows].map((i) => [ranking.place[i] || "", text(data.labels[i]), ...cells.map((cell) => cell(i)),
    placeText(ranking, i)].join(","))
  // With the mark by which spreadsheets know UTF-8.
  return `\ufeff${described().map(({titles}) => quoted(titles)).join(",")}\n${lines.join("\n")}\n`
}

// What the columns of the CSV are and what is chosen, so that it comes back with its objectives,
// directions and units: CSVW with an entry of our own, as read_table has it.
function metadata(rows, state, name) {
  const chosen = state.chosen === null ? {} : {chosen: state.chosen, reason: state.reason}
  return `${JSON.stringify({
    "@context": "http://www.w3.org/ns/csvw",
    url: encodeURIComponent(name),
    dialect: {commentPrefix: null},
    "pymoo-psi:rows": rows.length,
    "pymoo-psi:head": {...data.export.head, ranges: rangesOf(state), ...chosen},
    tableSchema: {columns: described()},
  }, null, 1)}\n`
}
