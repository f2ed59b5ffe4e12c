// States of the page, read from untrusted files and written as decisions, and what people hold.

const MOST_PINS = 5

// A state from untrusted input, a file; a remark names what does not fit.
function checked(data, anything) {
  const lost = new Set(isObject(anything) ? [] : ["what should be a state"])
  const fitting = (key, fits, otherwise, object = anything) => {
    const value = entryOf(object, key)
    if (value === undefined || fits(value)) return value ?? otherwise
    lost.add(key)
    return otherwise
  }
  const kept = (key, fits) => (item) => fits(item) || (lost.add(key), false)
  const entries = (key, fits, object) => byName(entriesOf(fitting(key, isObject, {}, object)).filter(
    kept(key, ([name, value]) => data.by.get(name)?.name === name && fits(data.by.get(name), value))))
  const items = (key, fits, object) => [...new Set(fitting(key, Array.isArray, [], object).filter(kept(key, fits)))]
  const isDesign = (name) => isText(name) && data.rowOf.has(name)
  const isPair = (pair) => Array.isArray(pair) && pair.length === 2 && pair.some((end) => end !== null) &&
    pair.every((end) => end === null || isNumber(end)) && !(pair.every(isNumber) && pair[0] > pair[1])
  const isName = (name) => data.by.has(name)
  const isAnswer = (answer) => Array.isArray(answer) && answer.length === 3 && answer.every(isText) && RELATIONS.includes(answer[1])
  const rows = entryOf(anything, "rows") ?? {}
  const isText = (value) => typeof value === "string"
  // What somebody holds at a date, checked as a state is.
  const position = (one) => {
    const {state: {limits, chosen, reason, preference, answers}, remarks} = checked(data, {limits: one.limits, chosen: one.chosen,
      reason: one.reason, answers: one.answers, preference: {weights: one.weights, aspiration: one.aspiration}})
    if (remarks.length) lost.add("positions")
    const [name, date] = [one.name, one.date].map((text) => (isText(text) ? text.slice(0, 60) : ""))
    return {name, date, chosen, limits, ...preference, reason, answers}
  }

  // Texts that no design has any more allow none; if no text is known, the choice is foreign.
  const isKnown = (texts, list) => Array.isArray(list) && (list.length === 0 || list.some((text) => texts.includes(text)))
  const limits = entries("limits", ({texts, role}, limit) =>
    texts ? isKnown(texts, limit) : role !== "geometric" && (isNumber(limit) || isPair(limit)))
  for (const [name, limit] of entriesOf(limits)) {
    const {texts} = data.by.get(name)
    if (texts) limits[name] = texts.filter((text) => limit.includes(text))
    if (isNumber(limit)) limits[name] = [null, limit] // it is the greatest
    if (limits[name].length < limit.length) lost.add("limits")
  }
  const isOrder = (order) => isObject(order) && (["distance", "label", "preference"].includes(order.by)
    || (order.by === "column" && data.by.has(order.name)))
  const order = fitting("order", isOrder, {by: "distance"})
  const preference = entryOf(anything, "preference")
  const state = {
    limits,
    fixed: entryOf(anything, "fixed") === true,
    dominated: entryOf(anything, "dominated") === true,
    // The rows of objectives: their order, those that are hidden, those with the other scale.
    rows: byName(["order", "hidden", "turned"].map((key) => [key, items(key, isName, rows)])),
    plot: fitting("plot", (names) => Array.isArray(names) && names.every(isName), []), // across and up of both
    pins: items("pins", isDesign).slice(0, MOST_PINS),
    answers: items("answers", isAnswer),
    chosen: fitting("chosen", isDesign, null),
    order: {by: order.by, ...(order.by === "column" ? {name: order.name} : {}), down: order.down === true},
    preference: {
      weights: entries("weights", (column, weight) => isObjective(column) && isNumber(weight) && weight >= 0, preference),
      aspiration: entries("aspiration", (column, value) => isObjective(column) && isNumber(value), preference),
    },
    // In one order, each once, whatever files they come from and in whatever order.
    positions: [...new Map(items("positions", isObject).map(position).filter(({name}) => name)
      .map((one) => [[one.date, one.name, one.chosen ?? "", JSON.stringify(one)].join("\0"), one]))].sort().map(([, one]) => one), // by their keys
    decided: fitting("decided", (one) => isObject(one) && isDesign(one.chosen) && isText(one.date) && [one.agree, one.dissent].every((list) => Array.isArray(list) && list.every(isText)), null),
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
  const same = (list, names) => Array.isArray(list) && JSON.stringify([...list].sort()) === JSON.stringify([...names].sort())
  const unlike = data.columns.find(({name, unit}) => unit && (entryOf(units, name) ?? unit) !== unit)
  const refused = !isObject(page) ? "it is not a decision saved by a page"
    : !same(objectives, own.objectives) || !same(maximize, own.maximize) ? "it has other objectives or directions"
    : unlike ? `its unit of ${unlike.name} differs`
    : normalize !== data.normalize ? "it measures distances differently (normalize)"
    : isFixed(ranges) && entriesOf(rangesOf(data, {fixed: true})).some(([name, ends]) =>
      String(entryOf(ranges, name)) !== String(ends)) ? "it has other fixed ranges" : ""
  return refused ? {state: null, remarks: [`The file cannot be opened: ${refused}.`]} : stateOf(data, content)
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

// Positions: what each name holds last, what separates two of them, and what all regret least
// (selection's separation_sentences).
const latest = (positions) => [...new Map(positions.map((one) => [one.name, one])).values()]

function separation(data, ranking, positions) {
  const held = latest(positions).filter(({chosen}) => data.rowOf.has(chosen))
  const row = ({chosen}) => data.rowOf.get(chosen)
  const measure = ranking.count ? ranking : data.whole
  const sentences = held.flatMap((one, k) => held.slice(0, k).flatMap((other) => one.chosen === other.chosen ? [] : [
    against(data, measure, "apart", row(one), row(other), {name: one.name, holder: other.name})]))
  if (!sentences.length || !ranking.count) return sentences
  const regret = (i, {weights, chosen}) => {
    const given = data.objectives.map(({name}) => entryOf(weights, name) ?? 1)
    const most = max(...given) || 1
    return max(0, ...data.F.map((column, j) => given[j] / most * (column[i] - column[data.rowOf.get(chosen)]) / measure.frame.lengths[j]))
  }
  let [best, least] = [-1, [Infinity, Infinity]]
  for (const i of ranking.front) {
    const regrets = held.map((one) => regret(i, one))
    const key = [max(...regrets), sum(regrets)].map((value) => round(value / TIE))
    if (key[0] < least[0] || (key[0] === least[0] && key[1] < least[1])) [best, least] = [i, key]
  }
  const regrets = held.map((one) => `${one.name} ${percent(regret(best, one))}`)
  return [...sentences, sentence(data, "least regret", {design: capital(data.names[best]), regrets: regrets.join(", ")})]
}
