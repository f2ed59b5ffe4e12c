// What limits reject, and at which limits another design is proposed.

// The designs within all limits, and what each limit rejects. A value that is missing keeps none.
//   mask, count  prototypes are always in the mask and never counted
//   rejected     by name of the column, which designs its limit rejects
function limited(state) {
  const {n, total} = data
  const rejected = new Map()
  for (const [name, limit] of entriesOf(state.limits)) {
    const {values, texts} = data.by.get(name)
    const out = new Uint8Array(n)
    rejected.set(name, out)
    if (texts) {
      const rejects = texts.map((text) => !limit.includes(text))
      for (let i = 0; i < n; i++) out[i] = rejects[values[i]]
      continue
    }
    const least = limit[0] ?? -Number.MAX_VALUE
    const most = limit[1] ?? Number.MAX_VALUE
    for (let i = 0; i < n; i++) out[i] = values[i] >= least && values[i] <= most ? 0 : 1
  }
  const mask = new Uint8Array(total).fill(1)
  for (const out of rejected.values()) for (let i = 0; i < n; i++) mask[i] &= 1 - out[i]
  return {mask, count: sum(mask) - (total - n), rejected}
}

const isTwisted = ([low, high]) => low !== null && high !== null && low > high
const limitText = ({name, unit}, end, value) =>
  `${name} ${end ? "at most" : "at least"} ${withUnit({unit}, exact(value))}`

// At which limits another design is proposed (selection's switching_values): as each that is set, or
// that no objective has on its worse side, is tightened or loosened over the values that designs have.
// A generator, which pauses after each ranking. Returns {name, end, looser, value, row, next, exact, written}s:
// value is the limit up to which the proposal stays, or from which, looser, it does not; null if it
// stays at any; row the design proposed then, -1 for none; next the limit there; limit the value
// in words; isBest that no design is better.
const MOST_STEPS = 200
function* switches(state, now) {
  const found = []
  for (const column of data.columns) {
    if (column.texts) continue
    const pair = entryOf(state.limits, column.name) ?? [null, null]
    for (const end of [0, 1]) for (const looser of [false, true]) {
      const isWorse = isObjective(column) && end === (column.maximize ? 0 : 1)
      if (pair[end] !== null || (isWorse && !looser)) found.push(yield* switchOf(state, now, column, pair, end, looser, isWorse))
    }
  }
  return found
}

function* switchOf(state, now, column, pair, end, looser, isWorse) {
  const {name, values} = column
  const sign = end ? 1 : -1
  const without = {...state.limits, [name]: pair.map((limit, k) => (k === end ? null : limit))}
  const free = looser ? limited({limits: without}) : now
  let rows = picked(data.designs, (i) => free.mask[i])
  if (isWorse) rows = looser ? ranked(free.mask).front : now.front
  const known = gathered(values, rows).map((value) => sign * value).sort()
  let steps = [...new Set(known)].filter((value) => value === value && (!looser || value > sign * pair[end]))
  if (!looser) steps = steps.reverse()
  const first = now.best[0] ?? -1
  const proposedAt = (step) => { // the row, or null for the same
    const mask = new Uint8Array(data.total)
    for (const i of rows) if (looser ? sign * values[i] <= steps[step] : sign * values[i] < steps[step]) mask[i] = 1
    const {last} = data
    const {best} = ranked(mask, now.fixed)
    data.last = last
    const isSame = first < 0 ? !best.length : best.includes(first)
    return isSame ? null : best[0] ?? -1
  }
  const exact = steps.length <= MOST_STEPS
  const stride = exact ? 1 : ceil(steps.length / 64)
  let [before, at, row] = [-1, -1, null]
  while (row === null && before < steps.length - 1) {
    at = min(before + stride, steps.length - 1)
    row = proposedAt(at)
    yield
    if (row === null) before = at
  }
  while (row !== null && at - before > 1) {
    const middle = (at + before) >> 1
    const there = proposedAt(middle)
    yield
    if (there === null) before = middle
    else [at, row] = [middle, there]
  }
  if (row === null) return {name, end, looser, value: null, row: -1, next: null, exact, isBest: false}
  const next = looser ? steps[at] : steps[at + 1]
  const value = sign * steps[at] + 0
  const [near, digits] = inDigits(value, gathered(values, picked(data.designs, (i) => free.mask[i])), looser === (end === 1))
  return {name, end, looser, value, row, next: next === undefined ? null : sign * next + 0, exact, limit: withUnit(column, short(near, digits, decimalsOf(column, now))), isBest: row < 0 && pair[end] === null}
}

// Sentences on them, each with what it is on; the last one is on all objectives in which no design is better.
function switchTexts(found) {
  const changes = found.filter(({value}) => value !== null)
  const best = changes.filter(({isBest}) => isBest)
  const texts = changes.filter(({isBest}) => !isBest).map((one) => [switchText(one), one])
  if (best.length) texts.push([sentence("none better", {objectives: listed(best.map(({name}) => name), "or")}), {...best[0], next: null, exact: true}])
  return texts
}

function switchText({name, end, looser, limit, row}, other = row < 0 ? sentence("none") : sentence("other", {design: data.names[row]})) {
  return sentence(`${end ? "upper" : "lower"} ${looser ? "looser" : "tighter"}`, {column: name, other, limit})
}
