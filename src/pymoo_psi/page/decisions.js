// States of the page, read from untrusted files and written as decisions, and what people hold.

const MOST_PINS = 5

// Minutes in UTC, the second and its fraction, a text in the order of time as table's Decision has it:
// without a time 0:00, without an offset UTC; "" of what is no date. DATE is the text of _DATE there.
const DATE = /^(\d{4}-\d\d-\d\d)(?:[T ]([01]\d|2[0-3]):([0-5]\d)(?::([0-5]\d)(?:\.(\d+))?)?(?:Z|([+-])([01]\d|2[0-3]):([0-5]\d))?)?$/
function timeOf(date) {
  const parts = DATE.exec(date)
  if (!parts) return ""
  const [, day, hour = 0, minute = 0, second = "00", fraction = "", sign, hours = 0, minutes = 0] = parts
  const start = new Date(`${day}T00:00Z`)
  // A 30 February is 2 March, or none; years of Python begin at 1.
  if (!isNumber(+start) || start.toISOString().slice(0, 10) !== day || day < "0001") return ""
  const offset = (sign === "-" ? -1 : 1) * (hours * 60 + +minutes)
  const time = start / 60000 + hour * 60 + +minute - offset
  return `${5e9 + time}:${second}.${fraction.replace(/0+$/, "")}` // ten digits in all years
}

// A state from untrusted input, a file; a remark names what does not fit.
function checked(data, anything) {
  const lost = new Set(isObject(anything) ? [] : ["what should be a state"])
  const fitting = (key, fits, otherwise, object = anything) => {
    const value = entryOf(object, key)
    if (value === undefined || fits(value)) return value ?? otherwise
    lost.add(key)
    return otherwise
  }
  // A list of different items, and values by the names of columns, without those that do not fit.
  const items = (key, fits, object) => [...new Set(fitting(key, Array.isArray, [], object))]
    .filter((item) => fits(item) || (lost.add(key), false))
  const entries = (key, read, object) => {
    const values = byName()
    for (const [name, entry] of entriesOf(fitting(key, isObject, {}, object))) {
      const column = data.by.get(name)
      const value = column && read(column, entry)
      if (value === undefined) lost.add(key)
      else values[name] = value
    }
    return values
  }
  const isText = (value) => typeof value === "string"
  const isList = (list, fits, most = Infinity) => Array.isArray(list) && list.length <= most && list.every(fits)
  const isTexts = (list) => isList(list, isText)
  const isName = (name) => data.by.has(name)
  const isDesign = (name) => isText(name) && data.rowOf.has(name)
  const isDate = (text) => isText(text) && (text === "" || timeOf(text) !== "")
  const isAnswer = (answer) => isList(answer, isText, 3) && isText(answer[2]) && RELATIONS.includes(answer[1])
  const isPair = (pair) => isList(pair, (end) => end === null || isNumber(end)) && pair.length === 2 && pair.some(isNumber) && !(pair.every(isNumber) && pair[0] > pair[1])
  const isOrder = (order) => isObject(order) && (["distance", "label", "preference"].includes(order.by) || (order.by === "column" && isName(order.name)))
  const isDecided = (one) => isObject(one) && isDesign(one.chosen) && [[one.date], one.agree, one.dissent].every(isTexts)
  // Texts that no design has any more allow none; if no text is known, the choice is foreign.
  const limit = ({texts, role}, value) => {
    if (!texts && isNumber(value)) return [null, value] // it is the greatest
    if (!texts) return role !== "geometric" && isPair(value) ? value : undefined
    if (!Array.isArray(value)) return undefined
    const known = texts.filter((text) => value.includes(text))
    if (known.length < value.length) lost.add("limits")
    return known.length || !value.length ? known : undefined
  }
  // What somebody holds at a date, checked as a state is; the choice may be of other designs.
  const position = (one) => {
    const {state: {limits, reason, preference, answers}, remarks} = checked(data, {...one, chosen: null, positions: [], preference: one})
    if (remarks.length) lost.add("positions")
    const name = isText(one.name) ? one.name.slice(0, 60) : ""
    return {name, date: fitting("date", isDate, "", one), chosen: fitting("chosen", isText, null, one), limits, ...preference, reason, answers}
  }
  const numberIf = (fits) => (column, value) => isObjective(column) && isNumber(value) && fits(value) ? value : undefined
  const {by, name, down} = fitting("order", isOrder, {by: "distance"})
  const [rows, preference] = ["rows", "preference"].map((key) => entryOf(anything, key) ?? {})
  const positions = items("positions", isObject).map(position).filter((one) => one.name)
  const state = {
    limits: entries("limits", limit),
    fixed: entryOf(anything, "fixed") === true,
    dominated: entryOf(anything, "dominated") === true,
    // The rows of objectives: their order, those that are hidden, those with the other scale.
    rows: byName(["order", "hidden", "turned"].map((key) => [key, items(key, isName, rows)])),
    plot: fitting("plot", (names) => isList(names, isName, 4), []), // across and up of both
    pins: items("pins", isDesign).slice(0, MOST_PINS),
    answers: items("answers", isAnswer),
    chosen: fitting("chosen", isDesign, null),
    order: {by, ...by === "column" ? {name} : {}, down: down === true},
    preference: {
      weights: entries("weights", numberIf((weight) => weight >= 0), preference),
      aspiration: entries("aspiration", numberIf(() => true), preference),
    },
    // In one order, each once, whatever files they come from and in whatever order.
    positions: [...new Map(positions.map((one) => [[timeOf(one.date), one.date, one.name, one.chosen ?? "", JSON.stringify(one)].join("\0"), one]))]
      .sort().map(([, one]) => one), // by their keys
    decided: fitting("decided", isDecided, null),
    reason: fitting("reason", isText, "").slice(0, 10000),
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
function decisionOf(data, state, date) {
  const {limits, reason, chosen, positions, decided, ...view} = state
  const row = data.rowOf.get(chosen)
  const valueOf = ({texts, values}) => texts ? texts[values[row]] : isNumber(values[row]) ? values[row] : null
  return {
    ...data.opens_with,
    ranges: rangesOf(data, state),
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
      values: row === undefined ? {} : byName(data.columns.filter(({role}) => role !== "geometric")
        .map((column) => [column.name, valueOf(column)])),
      state: view,
    },
  }
}

const initialState = (data) => stateOf(data, data.opens_with)

// The state that a decision file holds, or null if it is about something else.
function opened(data, text) {
  const content = parsed(text)
  const {objectives, maximize = [], normalize = true, units, ranges, page} = isObject(content) ? content : {} // Python leaves defaults out
  const own = data.opens_with
  const differs = (list, names) => !Array.isArray(list) || JSON.stringify([...list].sort()) !== JSON.stringify([...names].sort())
  const unlike = data.columns.find(({name, unit}) => unit && (entryOf(units, name) ?? unit) !== unit)
  const reasons = [
    [!isObject(page), "it is not a decision saved by a page"],
    [differs(objectives, own.objectives) || differs(maximize, own.maximize), "it has other objectives or directions"],
    [unlike, `its unit of ${unlike?.name} differs`],
    [normalize !== data.normalize, "it measures distances differently (normalize)"],
    [isFixed(ranges) && entriesOf(rangesOf(data, {fixed: true})).some(([name, ends]) => String(entryOf(ranges, name)) !== String(ends)),
      "it has other fixed ranges"],
  ]
  const reason = reasons.find(([isRefused]) => isRefused)
  return reason ? {state: null, remarks: [`The file cannot be opened: ${reason[1]}.`]} : stateOf(data, content)
}

// The state of a formulation, and what a reader must know of it.
function stateOf(data, {limits, chosen, reason, ranges, positions, decided, page: {values, state: view}}) {
  const {state, remarks} = checked(data, {...view, fixed: isFixed(ranges), limits, chosen, reason, positions, decided})
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

function separation(data, ranking, positions) {
  const held = latest(positions).filter(({chosen}) => data.rowOf.has(chosen)).map((one) => ({...one, row: data.rowOf.get(one.chosen)}))
  const measure = ranking.count ? ranking : data.whole
  const sentences = held.flatMap((one, k) => held.slice(0, k).filter(({row}) => row !== one.row).map((other) =>
    against(data, measure, "apart", one.row, other.row, {name: one.name, holder: other.name})))
  if (!sentences.length || !ranking.count) return sentences
  // In an objective in which all designs left are equal, the range is that of these and the choices.
  const {lengths: ofAll} = new Frame(data.F, joined(ranking.front, held.map(({row}) => row)), true)
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
  if (greatest < TIE) return [...sentences, sentence("no regret", {design})]
  const isGreatest = (loss) => loss >= greatest - TIE // also of a greatest so large that this is itself
  const who = losses.findIndex((list) => list.some(isGreatest))
  const others = next ? sentence("others regret", {share: percent(next.greatest)}) : ""
  return [...sentences, sentence("least regret", {design, name: held[who].name, share: percent(greatest),
    objective: data.objectives[losses[who].findIndex(isGreatest)].name, others})]
}
