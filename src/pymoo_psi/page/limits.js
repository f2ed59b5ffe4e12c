// What limits reject, and at which limits another design is proposed.

// The designs within all limits, and what each limit rejects. A value that is missing keeps none.
//   mask, count  prototypes are always in the mask and never counted
//   rejected     by name of the column, which designs its limit rejects
function limited(data, state) {
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

const limitText = ({name, unit}, end, value) =>
  `${name} ${end ? "at most" : "at least"} ${exact(value)}${unit ? ` ${unit}` : ""}`

// At which limits another design is proposed (selection's switching_values): as each that is set, or
// that no objective has on its worse side, is tightened or loosened over the values that designs have.
// A generator, which pauses after each ranking. Each {name, end, looser, value, row, next, exact}:
// value is the limit up to which the proposal stays, or from which, looser, it does not; null if it
// stays at any; row the design proposed then, -1 for none; next the limit there.
const MOST_STEPS = 200
function* switches(data, state, now) {
  const first = now.best[0] ?? -1
  const bestOf = (mask) => {
    const {last} = data
    const {best, place} = ranked(data, mask, now.fixed)
    data.last = last
    return {row: best[0] ?? -1, differs: first < 0 ? best.length > 0 : place[first] !== 1}
  }
  for (const {name, role, maximize, values, texts} of data.columns) {
    if (texts || role === "geometric") continue
    const pair = entryOf(state.limits, name) ?? [null, null]
    for (const [end, looser] of [[0, false], [0, true], [1, false], [1, true]]) {
      const isWorse = role === "objective" && end === (maximize ? 0 : 1)
      if (pair[end] === null && (looser || !isWorse)) continue
      const free = looser ? limited(data, {...state, limits: {...state.limits, [name]: pair.map((limit, k) => (k === end ? null : limit))}}) : now
      const rows = isWorse ? looser ? ranked(data, free.mask).front : now.front : picked(data.designs, (i) => free.mask[i])
      const sign = end ? 1 : -1
      const known = gathered(values, rows).map((value) => sign * value)
      let steps = [...new Set(known.sort())].filter((value) => value === value && (!looser || value > sign * pair[end]))
      if (!looser) steps = steps.reverse()
      const at = (step) => {
        const mask = new Uint8Array(data.total)
        for (const i of rows) if (looser ? sign * values[i] <= steps[step] : sign * values[i] < steps[step]) mask[i] = 1
        return bestOf(mask)
      }
      const exact = steps.length <= MOST_STEPS
      const stride = exact ? 1 : ceil(steps.length / 64)
      let [before, found] = [-1, {name, end, looser, value: null, row: -1, next: null, exact}]
      for (let step = stride - 1; before < steps.length - 1; step += stride) {
        step = min(step, steps.length - 1)
        let then = at(step)
        yield null
        while (then.differs && step - before > 1) {
          const middle = (step + before) >> 1
          const there = at(middle)
          yield null
          if (there.differs) [step, then] = [middle, there]
          else before = middle
        }
        before = step
        if (!then.differs) continue
        const next = looser ? steps[step] : steps[step + 1]
        found = {...found, value: sign * steps[step] + 0, row: then.row, next: next === undefined ? null : sign * next + 0}
        break
      }
      yield found
    }
  }
}

// One of them in words.
function switchText(data, {name, end, looser, value, row}) {
  const {unit} = data.by.get(name)
  return sentence(data, `${end ? "upper" : "lower"} ${looser ? "looser" : "tighter"}`, {column: name,
    other: row < 0 ? sentence(data, "none") : sentence(data, "other", {design: data.names[row]}),
    limit: `${short(inSixDigits(value, looser === (end === 1)), 6)}${unit ? ` ${unit}` : ""}`})
}
