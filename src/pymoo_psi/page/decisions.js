// States of the page, read from untrusted files and written as decisions, and what people hold.

const MOST_PINS = 5

// The time of a date of a position, as table's Decision has it: UTC where it has no offset; NaN of what is no
// date. Programs write them; what a person wrote by hand the commands check further.
function timeOf(date) {
  const [isDate, time] = date.match(/^\d{4}-\d\d-\d\d(.*)$/) ?? []
  const hasOffset = /Z|[+-]\d/.test(time)
  return isDate ? Date.parse(time && !hasOffset ? `${date}Z` : date) : NaN
}

// How untrusted input, a file, is read: a reader returns a value as the page has it, or undefined where it does
// not fit, and calls `lose` where it leaves out a part.

const isText = (value) => typeof value === "string"
const isTexts = (list) => Array.isArray(list) && list.every(isText)
const isDesign = (name) => data.rowOf.has(name)
const isColumn = (name) => data.by.has(name)
const isAnswer = (answer) => isTexts(answer) && answer.length === 3 && RELATIONS.includes(answer[1])
const isPair = (pair) => Array.isArray(pair) && pair.length === 2 && pair.every((end) => end === null || isNumber(end)) &&
  pair.some(isNumber) && !isTwisted(pair)
const isTrue = (value) => value === true
const only = (fits) => (value) => (fits(value) ? value : undefined)
// Different items.
const listOf = (read) => (list, lose) => {
  if (!Array.isArray(list)) return undefined
  const items = unique(list).map((item) => read(item, lose))
  if (items.includes(undefined)) lose()
  return items.filter((item) => item !== undefined)
}
// Values by the names of columns.
const byColumn = (read) => (object, lose) => {
  if (!isObject(object)) return undefined
  const entries = entriesOf(object).map(([name, entry]) => [name, isColumn(name) ? read(entry, lose, columnOf(name)) : undefined])
  const fitting = entries.filter(([, value]) => value !== undefined)
  if (fitting.length < entries.length) lose()
  return Object.fromEntries(fitting)
}
const numbersIf = (fits) => byColumn((value, lose, column) =>
  isObjective(column) && isNumber(value) && fits(value) ? value : undefined)
const columnsIn = listOf(only(isColumn))
// A number is the greatest value. Texts that no design has any more allow none; if no text is known, the choice
// is foreign.
const limitsIn = byColumn((value, lose, {texts}) => {
  if (!texts) return isNumber(value) ? [null, value] : only(isPair)(value)
  if (!Array.isArray(value)) return undefined
  const known = texts.filter((text) => value.includes(text))
  if (known.length < value.length) lose()
  return known.length || !value.length ? known : undefined
})

// The fields of a state and of a position: their readers, and what they are where there is nothing that fits.
// What somebody says is personal: a position keeps it, and it is not that of the next person.
const PERSONAL = {
  weights: [numbersIf((weight) => weight >= 0), {}],
  aspiration: [numbersIf(() => true), {}],
  reason: [only(isText), ""],
  answers: [listOf(only(isAnswer)), []],
}
const personal = Object.keys(PERSONAL)
const POSITION = {
  name: [only(isText), ""],
  date: [only((date) => date === "" || (isText(date) && isNumber(timeOf(date)))), ""],
  chosen: [only(isText), null], // perhaps of other designs
  limits: [limitsIn, {}],
  ...PERSONAL,
}
const STATE = {
  limits: [limitsIn, {}],
  fixed: [isTrue, false],
  dominated: [isTrue, false],
  // The rows of objectives: their order, those that are hidden, those with the other scale.
  rows: [columnsIn, []],
  hidden: [columnsIn, []],
  turned: [columnsIn, []],
  plot: [listOf(only((name) => columnOf(name)?.texts === null)), []], // across and up
  pins: [listOf(only(isDesign)), []],
  chosen: [only(isDesign), null],
  sorted: [only((name) => name === data.label || isColumn(name)), null], // by a column or the label; null: by place
  down: [isTrue, false],
  positions: [positionsIn, []],
  decided: [only((one) => isObject(one) && isDesign(one.chosen) && [[one.date], one.agree, one.dissent].every(isTexts)), null],
  ...PERSONAL,
  owners: [only((names) => isObject(names) && isTexts(Object.values(names))), {}], // who has said it, of what is personal
}

function fieldsOf(fields, object, lose) {
  const values = {}
  for (const [key, [read, otherwise]] of entriesOf(fields)) {
    const entry = entryOf(object, key)
    const value = entry === undefined ? otherwise : read(entry, (part) => lose(part ? `${key} (${part})` : key))
    if (value === undefined) lose(key)
    values[key] = value ?? otherwise
  }
  return values
}

// In one order, each once, whatever files they come from and in whatever order.
function positionsIn(list, lose) {
  const named = listOf((one) => {
    const position = fieldsOf(POSITION, one, lose)
    return position.name ? position : undefined
  })
  const keyed = (named(list, lose) ?? []).map((one) =>
    [[one.date && 5e15 + timeOf(one.date), one.date, one.name, one.chosen ?? "", JSON.stringify(one)].join("\0"), one])
  return [...new Map(keyed)].sort().map(([, one]) => one) // by their keys
}

// A state from untrusted input; a remark names what does not fit.
function checked(anything) {
  const lost = new Set()
  const state = fieldsOf(STATE, anything, (key) => lost.add(key))
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
  const row = rowOf(chosen)
  const valueOf = ({texts, values}) => texts ? texts[values[row]] : isNumber(values[row]) ? values[row] : null
  return {
    ...data.opens_with,
    ranges: rangesOf(state),
    units: Object.fromEntries(data.columns.filter((column) => column.unit && (isObjective(column) || entryOf(limits, column.name)))
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
      values: row < 0 ? {} : Object.fromEntries(data.columns.map((column) => [column.name, valueOf(column)])),
      state: view,
    },
  }
}

// The state that a decision file holds, or null if it is about something else. What a file without objectives
// leaves out is as on this page, else Python's default.
function opened(text) {
  const content = parsed(text)
  const own = data.opens_with
  const isDecision = ["objectives", "limits", "chosen", "positions"].some((key) => entryOf(content, key) !== undefined)
  const defaults = entryOf(content, "objectives") === undefined ? own : {maximize: [], normalize: true}
  const {objectives, maximize, normalize, units, ranges, page = {}} = {...defaults, ...content}
  const sorted = (list) => JSON.stringify(Array.isArray(list) && [...list].sort())
  const isOther = !isDecision || !isObject(page) || normalize !== data.normalize ||
    sorted(objectives) !== sorted(own.objectives) || sorted(maximize) !== sorted(own.maximize) ||
    data.columns.some(({name, unit}) => unit && (entryOf(units, name) ?? unit) !== unit) ||
    (isFixed(ranges) && entriesOf(rangesOf({fixed: true})).some(([name, ends]) => String(entryOf(ranges, name)) !== String(ends)))
  return isOther ? {state: null, remarks: [sentence("foreign file")]} : stateOf(content)
}

// The state of a formulation, and what a reader must know of it.
function stateOf({limits, chosen, reason, ranges, positions, decided, page: {values, state: view} = {}}) {
  const {state, remarks} = checked({...view, fixed: isFixed(ranges), limits, chosen, reason, positions, decided})
  // Where no page has written who has given the reason, it is who has a position with it.
  const owner = state.positions.findLast((one) => one.chosen === state.chosen && one.reason === state.reason)
  if (owner && state.reason && !view?.owners) state.owners = {reason: owner.name}
  const row = rowOf(state.chosen)
  const changes = data.objectives.filter((column) => row >= 0 && isObject(values) &&
    entryOf(values, column.name) !== column.values[row])
  if (changes.length) {
    remarks.unshift(sentence("changed", {design: state.chosen, objectives: listed(namesOf(changes))}))
  }
  return {state, remarks}
}

// Positions: what each name holds last, what separates two of them, and what costs all the least
// (selection's separation_sentences).
const latest = (positions) => [...new Map(positions.map((one) => [one.name, one])).values()]

function separation(ranking, positions) {
  const held = latest(positions).map((one) => ({...one, row: rowOf(one.chosen)})).filter(({row}) => row >= 0)
  const measure = ranking.count ? ranking : data.whole
  const sentences = held.flatMap((one, k) => held.slice(0, k).filter(({row}) => row !== one.row).map((other) =>
    against(measure, "apart", one.row, other.row, {name: one.name, holder: other.name})))
  return sentences.length && ranking.count ? [regretText(ranking, held), ...sentences] : sentences
}

// The design whose greatest cost to somebody is least, and by ties the one whose costs add up to least.
function regretText({front, frame}, held) {
  // In an objective in which all designs left are equal, the range is that of these and the choices.
  const {lengths: ofAll} = frameOf(data.F, joined(front, rowsOf(held)), true)
  const lengths = frame.lengths.map((length, j) => length === Infinity ? ofAll[j] : length)
  const lossesOf = (i, {weights, row}) => {
    const ratios = ratiosOf(weights)
    return data.F.map((column, j) => ratios[j] * (column[i] - column[row]) / lengths[j])
  }
  const costs = [...front].map((row) => {
    const losses = held.map((one) => lossesOf(row, one))
    const regrets = losses.map((list) => max(0, ...list))
    const greatest = max(...regrets)
    return {row, losses, greatest, keys: [round(greatest / TIE), round(sum(regrets) / TIE)]}
  })
  const [{row, losses, greatest}, next] = costs.sort((a, b) => a.keys[0] - b.keys[0] || a.keys[1] - b.keys[1])
  const design = called(row)
  if (greatest < TIE) return sentence("no regret", {design})
  const isGreatest = (loss) => loss >= greatest - TIE // also of a greatest so large that this is itself
  const who = losses.findIndex((list) => list.some(isGreatest))
  const {name: objective} = data.objectives[losses[who].findIndex(isGreatest)]
  const others = next ? sentence("others regret", {share: percent(next.greatest)}) : ""
  return sentence("least regret", {design, name: held[who].name, share: percent(greatest), objective, others})
}
