// What limits reject, and at which limits another design is proposed.

// The designs within all limits, and what each limit rejects. A value that is missing keeps none.
//   mask, count  prototypes are always in the mask and never counted
//   rejected     by name of the column, which designs its limit rejects
function limited(state) {
  const {n, total} = data
  const rejected = new Map()
  const mask = new Uint8Array(total).fill(1)
  for (const [name, limit] of entriesOf(state.limits)) {
    const {values, texts} = columnOf(name)
    const allowed = texts?.map((text) => limit.includes(text))
    const least = limit[0] ?? -Number.MAX_VALUE
    const most = limit[1] ?? Number.MAX_VALUE
    const out = new Uint8Array(n)
    for (let i = 0; i < n; i++) {
      const isAllowed = texts ? allowed[values[i]] : values[i] >= least && values[i] <= most
      if (isAllowed) continue
      out[i] = 1
      mask[i] = 0
    }
    rejected.set(name, out)
  }
  return {mask, count: sum(mask) - (total - n), rejected}
}

// The end of its limits beyond which an objective gets worse: 0 is the lower one.
const worseEnd = ({maximize}) => (maximize ? 0 : 1)
const isTwisted = ([low, high]) => low !== null && high !== null && low > high
const limitText = ({name, unit}, end, value) =>
  `${name} ${end ? "at most" : "at least"} ${withUnit({unit}, exact(value))}`

// At which limits another design is proposed (analysis' switching_values): each end of a limit that is set, or
// that no objective has on its worse side, is tightened, and one that is set is loosened, over the values that
// designs have. A generator, which pauses after each ranking. Returns
//   name, end, looser   what is moved: 0 is the lower end
//   value               up to which the proposal stays or, looser, from which it does not; null if it stays
//   row, next           the design proposed then, -1 for none, and the limit there
//   isExact             whether all values were tried
//   condition           the limit in words
//   isBest              whether no design is better
const MOST_STEPS = 200
function* switches(state, now) {
  const changes = []
  for (const column of data.numeric) {
    const pair = entryOf(state.limits, column.name) ?? [null, null]
    for (const end of [0, 1]) {
      const isSet = pair[end] !== null
      const isWorse = isObjective(column) && end === worseEnd(column)
      if (isWorse || (isSet && pair[0] !== pair[1])) changes.push(yield* changeAt(now, {column, end, isSet, isWorse, mask: now.mask, looser: false}))
      if (!isSet) continue
      const {mask} = limited({limits: {...state.limits, [column.name]: pair.with(end, null)}})
      changes.push(yield* changeAt(now, {column, end, isSet, isWorse, mask, looser: true, present: pair[end]}))
    }
  }
  return changes
}

function* changeAt(now, moved) {
  const {column, end, looser, isSet, mask} = moved
  const {name, values} = column
  const {rows, steps, lets} = stepsOf(now, moved)
  const proposed = now.best[0] ?? -1
  // The row that is proposed at a step; null for the same.
  const changed = (step) => {
    const inside = new Uint8Array(data.total)
    for (const row of rows) if (lets(row, step)) inside[row] = 1
    const {best} = ranked(inside, now.fixed, now)
    const isSame = proposed < 0 ? !best.length : best.includes(proposed)
    return isSame ? null : best[0] ?? -1
  }
  const isExact = steps.length <= MOST_STEPS
  const [at, row] = yield* firstChange(steps.length, isExact ? 1 : ceil(steps.length / 64), changed)
  const change = {name, end, looser, isExact, row: row ?? -1}
  if (row === null) return {...change, value: null, next: null}
  const next = (looser ? steps[at] : steps[at + 1]) ?? null
  // A tighter limit has no effect at the value: 9.799999999999999 is 9.8.
  const value = looser ? steps[at] : Number(shortText(steps[at]) || steps[at])
  const [near, digits] = inDigits(value, gathered(values, picked(data.designs, (i) => mask[i])), looser === (end === 1))
  const limit = withUnit(column, short(near, digits, decimalsOf(column, now)))
  const condition = sentence(`${end ? "upper" : "lower"} ${looser ? "looser" : "tighter"}`, {column: withArticle(name), limit})
  return {...change, value: steps[at], next, condition, isBest: row < 0 && !isSet}
}

// The designs that count where a limit moves, their values as it passes them, and which of them it lets in.
function stepsOf(now, {column: {values}, end, looser, isWorse, mask, present}) {
  let rows = picked(data.designs, (i) => mask[i])
  if (isWorse) rows = looser ? ranked(mask, null, now).front : now.front // it rejects no other design without those that it dominates
  const isBeyond = (value, limit) => (end ? value > limit : value < limit)
  const steps = unique(gathered(values, rows).sort()).filter((value) => value === value && (!looser || isBeyond(value, present)))
  if (looser !== (end === 1)) steps.reverse()
  return {rows, steps, lets: (row, step) => (looser ? !isBeyond(values[row], steps[step]) : isBeyond(steps[step], values[row]))}
}

// The first step at which something changes, and to what: tried one after the other in strides, then by halves.
function* firstChange(count, stride, changed) {
  let before = -1
  let at = count
  let change = null
  while (at - before > 1) {
    const step = change === null ? min(before + stride, count - 1) : (at + before) >> 1
    const there = changed(step)
    yield
    if (there === null) before = step
    else {
      at = step
      change = there
    }
  }
  return [at, change]
}

// Changes that are known; the last one is of all objectives in which no design is better.
function changesOf(found) {
  const changes = found.filter(({value}) => value !== null)
  const best = changes.filter(({isBest}) => isBest)
  const others = changes.filter(({isBest}) => !isBest)
  if (!best.length) return others
  const objectives = withArticle(listed(namesOf(best), "or"))
  return [...others, {...best[0], condition: sentence("better", {objectives}), next: null, isExact: true}]
}
const outcomeOf = ({row}) => row < 0 ? sentence("none") : sentence("other", {design: called(row)})
