// States of the page, read from untrusted files and written as decisions, and what people hold.

const MOST_PINS = 5

// The time of a date of a position, in UTC as table's Decision has it: without a time 0:00, without an offset
// UTC; NaN of what is no date. DATE is the text of _DATE there.
const DATE = /^(?!0000)\d{4}-\d\d-\d\d([T ](?:[01]\d|2[0-3]):[0-5]\d(?::[0-5]\d(?:\.\d+)?)?(Z|[+-](?:[01]\d|2[0-3]):[0-5]\d)?)?$/
function timeOf(date) {
  const [, time, offset] = DATE.exec(date) ?? []
  const day = date.slice(0, 10)
  if (!new Date(day).toJSON()?.startsWith(day)) return NaN // a 30 February is 2 March, or none
  if (!time) return DATE.test(date) ? Date.parse(date) : NaN
  return Date.parse(date.replace(" ", "T") + (offset ? "" : "Z"))
}

// A state from untrusted input, a file; a remark names what does not fit.
function checked(anything) {
  const lost = new Set(isObject(anything) ? [] : ["what should be a state"])
  const fitting = (key, fits, otherwise, object = anything) => {
    const value = entryOf(object, key)
    if (value === undefined || fits(value)) return value ?? otherwise
    lost.add(key)
    return otherwise
  }
  // A list of different items, and values by the names of columns, without those that do not fit.
  const items = (key, fits) => [...new Set(fitting(key, Array.isArray, []))].filter((item) => fits(item) || !lost.add(key))
  const entries = (key, read) => {
    const values = byName()
    for (const [name, entry] of entriesOf(fitting(key, isObject, {}))) {
      const column = data.by.get(name)
      const value = column && read(column, entry)
      if (value === undefined) lost.add(key)
      else values[name] = value
    }
    return values
  }
  const isText = (value) => typeof value === "string"
  const isTexts = (list) => Array.isArray(list) && list.every(isText)
  const isName = (name) => data.by.has(name)
  const isDesign = (name) => data.rowOf.has(name)
  const isDate = (text) => text === "" || (isText(text) && isNumber(timeOf(text)))
  const isAnswer = (answer) => isTexts(answer) && answer.length === 3 && RELATIONS.includes(answer[1])
  const isEnd = (end) => end === null || isNumber(end)
  const isPair = (pair) => Array.isArray(pair) && pair.length === 2 && pair.every(isEnd) && pair.some(isNumber) && !isTwisted(pair)
  const isDecided = (one) => isObject(one) && isDesign(one.chosen) && [[one.date], one.agree, one.dissent].every(isTexts)
  // Texts that no design has any more allow none; if no text is known, the choice is foreign.
  const limit = ({texts}, value) => {
    if (!texts && isNumber(value)) return [null, value] // it is the greatest
    if (!texts) return isPair(value) ? value : undefined
    if (!Array.isArray(value)) return undefined
    const known = texts.filter((text) => value.includes(text))
    if (known.length < value.length) lost.add("limits")
    return known.length || !value.length ? known : undefined
  }
  // What somebody holds at a date, checked as a state is; the choice may be of other designs.
  const position = (one) => {
    const {state: {limits, reason, weights, aspiration, answers}, remarks} = checked({...one, chosen: null, positions: []})
    if (remarks.length) lost.add("positions")
    const name = isText(one.name) ? one.name : ""
    return {name, date: fitting("date", isDate, "", one), chosen: fitting("chosen", isText, null, one), limits, weights, aspiration, reason, answers}
  }
  const numberIf = (fits) => (column, value) => isObjective(column) && isNumber(value) && fits(value) ? value : undefined
  const positions = items("positions", isObject).map(position).filter((one) => one.name)
  const state = {
    limits: entries("limits", limit),
    fixed: entryOf(anything, "fixed") === true,
    dominated: entryOf(anything, "dominated") === true,
    // The rows of objectives: their order, those that are hidden, those with the other scale.
    rows: items("rows", isName),
    hidden: items("hidden", isName),
    turned: items("turned", isName),
    plot: items("plot", (name) => data.by.get(name)?.texts === null), // across and up
    pins: items("pins", isDesign).slice(0, MOST_PINS),
    answers: items("answers", isAnswer),
    chosen: fitting("chosen", isDesign, null),
    sorted: fitting("sorted", (name) => name === data.label || isName(name), null), // by a column or the label; null: by place
    down: entryOf(anything, "down") === true,
    weights: entries("weights", numberIf((weight) => weight >= 0)),
    aspiration: entries("aspiration", numberIf(() => true)),
    // In one order, each once, whatever files they come from and in whatever order.
    positions: [...new Map(positions.map((one) => [[one.date && 5e15 + timeOf(one.date), one.date, one.name, one.chosen ?? "", JSON.stringify(one)].join("\0"), one]))]
      .sort().map(([, one]) => one), // by their keys
    decided: fitting("decided", isDecided, null),
    reason: fitting("reason", isText, ""),
  }
  return {state, remarks: lost.size ? [`Not applied, as it does not fit these designs: ${[...lost].join(", ")}.`] : []}
}

function parsed(text) {
  try {
    return JSON.parse(text)
  } catch {
    return null
  }
}

// The decision as a formulation in JSON, for people, the page and the commands (table's Formulation);
// what only the page knows stands under "page". Nothing is chosen that nobody has chosen.
function decisionOf(state, date) {
  const {limits, reason, chosen, positions, decided, ...view} = state
  const row = data.rowOf.get(chosen)
  const valueOf = ({texts, values}) => texts ? texts[values[row]] : isNumber(values[row]) ? values[row] : null
  return {
    ...data.opens_with,
    ranges: rangesOf(state),
    units: byName(data.columns.filter(({name, role, unit}) => unit && (role === "objective" || entryOf(limits, name)))
      .map(({name, unit}) => [name, unit])),
    limits,
    chosen,
    reason,
    positions,
    decided,
    version: 1,
    page: {
      title: data.title,
      date,
      values: row === undefined ? {} : byName(data.columns.map((column) => [column.name, valueOf(column)])),
      state: view,
    },
  }
}

// The state that a decision file holds, or null if it is about something else.
function opened(text) {
  const content = parsed(text)
  const {objectives, maximize = [], normalize = true, units, ranges, page} = isObject(content) ? content : {} // Python leaves defaults out
  const own = data.opens_with
  const sorted = (list) => Array.isArray(list) ? JSON.stringify([...list].sort()) : ""
  const unlike = data.columns.find(({name, unit}) => unit && (entryOf(units, name) ?? unit) !== unit)
  const isOther = [
    !isObject(page), sorted(objectives) !== sorted(own.objectives), sorted(maximize) !== sorted(own.maximize), unlike, normalize !== data.normalize,
    isFixed(ranges) && entriesOf(rangesOf({fixed: true})).some(([name, ends]) => String(entryOf(ranges, name)) !== String(ends)),
  ]
  if (!isOther.some(Boolean)) return stateOf(content)
  return {state: null, remarks: ["The file cannot be opened: it is no decision on this page, or one with other objectives, directions, units or ranges."]}
}

// The state of a formulation, and what a reader must know of it.
function stateOf({limits, chosen, reason, ranges, positions, decided, page: {values, state: view}}) {
  const {state, remarks} = checked({...view, fixed: isFixed(ranges), limits, chosen, reason, positions, decided})
  const row = data.rowOf.get(state.chosen)
  const changes = data.objectives.filter((column) => row !== undefined && isObject(values) &&
    entryOf(values, column.name) !== column.values[row])
  if (changes.length) {
    remarks.unshift(`${capital(state.chosen)} has changed since then in ${listed(changes.map(({name}) => name))}.`)
  }
  return {state, remarks}
}

// Positions: what each name holds last, what separates two of them, and what costs all the least
// (selection's separation_sentences).
const latest = (positions) => [...new Map(positions.map((one) => [one.name, one])).values()]

function separation(ranking, positions) {
  const held = latest(positions).filter(({chosen}) => data.rowOf.has(chosen)).map((one) => ({...one, row: data.rowOf.get(one.chosen)}))
  const measure = ranking.count ? ranking : data.whole
  const sentences = held.flatMap((one, k) => held.slice(0, k).filter(({row}) => row !== one.row).map((other) =>
    against(measure, "apart", one.row, other.row, {name: one.name, holder: other.name})))
  if (!sentences.length || !ranking.count) return sentences
  // In an objective in which all designs left are equal, the range is that of these and the choices.
  const {lengths: ofAll} = frameOf(data.F, joined(ranking.front, held.map(({row}) => row)), true)
  const lengths = measure.frame.lengths.map((length, j) => length === Infinity ? ofAll[j] : length)
  const lossesOf = (i, {weights, row}) => {
    const given = data.objectives.map(({name}) => entryOf(weights, name) ?? 1)
    const most = max(...given) || 1
    return data.F.map((column, j) => given[j] / most * (column[i] - column[row]) / lengths[j])
  }
  const costs = [...ranking.front].map((row) => {
    const losses = held.map((one) => lossesOf(row, one))
    const regrets = losses.map((list) => max(0, ...list))
    const greatest = max(...regrets)
    return {row, losses, greatest, keys: [round(greatest / TIE), round(sum(regrets) / TIE)]}
  })
  const [{row, losses, greatest}, next] = costs.sort((a, b) => a.keys[0] - b.keys[0] || a.keys[1] - b.keys[1])
  const design = data.names[row]
  if (greatest < TIE) return [sentence("no regret", {design}), ...sentences]
  const isGreatest = (loss) => loss >= greatest - TIE // also of a greatest so large that this is itself
  const who = losses.findIndex((list) => list.some(isGreatest))
  const others = next ? sentence("others regret", {share: percent(next.greatest)}) : ""
  return [sentence("least regret", {design, name: held[who].name, share: percent(greatest),
    objective: data.objectives[losses[who].findIndex(isGreatest)].name, others}), ...sentences]
}
