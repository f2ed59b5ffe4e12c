// The designs, without a document, so that they are ranked in the page and in Node. Places, sentences
// and preferences equal those of pymoo_psi.pareto and pymoo_psi.selection; the numbers of their rules,
// such as NOISE and TIE, are defined by a line that the page puts before this script.
//
// Designs are rows 0 … data.n - 1, existing designs (prototypes) the rows behind, up to data.total.
// All arrays have one entry a row. Objectives in data.F are minimised and equal where they are equal
// up to rounding; columns, limits, states and sentences are in the original unit and direction.

let data // of the page: one table

const bytesOf = (base64) => {
  const text = atob(base64)
  const bytes = new Uint8Array(text.length)
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i)
  return bytes.buffer
}

const numbersOf = (base64) => new Float64Array(bytesOf(base64))

// The payload of the file as arrays; its numbers are little-endian float64 in base64.
function decode(payload) {
  const columns = payload.columns.map((column) => ({...column, values: numbersOf(column.values)}))
  data = {
    ...payload,
    columns,
    objectives: columns.filter(isObjective),
    numeric: columns.filter(({texts}) => !texts),
    textual: columns.filter(({texts}) => texts),
    by: new Map(columns.map((column) => [column.name, column])), // a Map, as any name may be a key, also __proto__
    optimal: new Uint8Array(bytesOf(payload.optimal)), // among all
    points: payload.points.map((text) => new Uint16Array(bytesOf(text))), // of the LPτ sequence, times N_WEIGHTS, by dimension
    more: [], // what `grow` has added
  }
  return addDesigns(payload.more ?? [])
}

// Add designs that came since, where there is no prototype: `names`, `labels` and the cells of columns.
function addDesigns(more) {
  for (const {names, labels, columns} of more) {
    data.names.push(...names)
    data.labels.push(...labels)
    data.n = data.names.length
    columns.forEach(({texts, values}, j) => {
      const column = data.columns[j]
      const known = column.texts
      const places = texts?.map((text) => known.includes(text) ? known.indexOf(text) : known.push(text) - 1)
      const cells = numbersOf(values).map((cell) => places?.[cell] ?? cell)
      column.values = Float64Array.from([...column.values, ...cells])
    })
  }
  const {n, names, objectives} = data
  const all = new Uint8Array(names.length).fill(1)
  const F = objectives.map(({maximize, values}) => { // equal where they are equal up to rounding
    const {least, group} = grouped(maximize ? values.map((value) => -value) : values)
    return gathered(least, group)
  })
  Object.assign(data, {
    F,
    total: names.length,
    designs: upTo(n),
    prototypes: upTo(names.length).subarray(n),
    rowOf: new Map(names.map((name, row) => [name, row])),
    dominator: new Int32Array(n).fill(-1), // of each design, the one found last, see `frontOf`
    boxes: null, // see `boxesOf`
    orders: [], // of the designs by an objective
    more: [...data.more, ...more],
    alphabetic: null,
  })
  // What was dominated stays so.
  if (more.length) {
    const boxes = boxesWithin(all)
    data.optimal = Uint8Array.from(data.designs, (i) => data.optimal[i] !== 0 && dominatorOf(boxes, pointOf(i), all) < 0)
  }
  data.whole = ranked(all)
  if (more.length) for (const column of data.numeric) {
    column.axis = [1, -1].map((sign, k) => endOf([column.axis[k], endOf(column.values, sign, data.whole.front)], sign))
  }
  data.fixed = fixedFrame() // the points U and N of fixed ranges
  data.wholeFixed = ranked(all, data.fixed) // by these
  return data
}

const namesOf = (list) => list.map(({name}) => name)
const rowsOf = (list) => list.map(({row}) => row)
const columnOf = (name) => data.by.get(name)
const called = (row) => data.names[row]
const rowOf = (name) => data.rowOf.get(name) ?? -1
const isObjective = ({role}) => role === "objective"
// Ranges in which distances are measured whatever the limits, by name, in increasing order: those
// that the page was made with, or those of all designs.
const isFixed = (ranges) => isObject(ranges) && Object.keys(ranges).length > 0
function fixedFrame() {
  const {objectives, opens_with: {ranges}, whole} = data
  if (!isFixed(ranges)) return whole.frame
  const [ideal, nadir] = [0, 1].map((end) => objectives.map(({name, maximize}) =>
    maximize ? -ranges[name][1 - end] : ranges[name][end]))
  return {ideal, nadir}
}
const rangesOf = ({fixed}) => !fixed ? {} : Object.fromEntries(data.objectives.map(({name, maximize}, j) => {
  const best = data.fixed.ideal[j]
  const worst = data.fixed.nadir[j]
  return [name, maximize ? [-worst, -best] : [best, worst]]
}))

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value)

const entryOf = (object, name) =>
  isObject(object) && Object.hasOwn(object, name) ? object[name] ?? undefined : undefined
