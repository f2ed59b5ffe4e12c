// The logic of the decision page, without a document, so that it runs in the page and in Node. Places,
// sentences and preferences equal those of pymoo_psi.pareto and pymoo_psi.selection.
//
// Designs are rows 0 … data.n - 1, existing designs (prototypes) the rows behind, up to data.total.
// All arrays have one entry a row. Objectives in data.F are minimised and equal where they are equal
// up to rounding; columns, limits, states and sentences are in the original unit and direction.
const isNumber = Number.isFinite
const entriesOf = Object.entries
const {abs, ceil, floor, hypot, log10, max, min, round, sqrt} = Math // charts.js and page.js use them, too
const Logic = (() => {
"use strict"

const NOISE = 64 * Number.EPSILON // as in pareto, which has the reasons for this one and the next three
const LAST_PLACES = 8 * Number.EPSILON
const TIE = 1e-9
const STEP = 0.01
const MOST_PINS = 5
let mark = "." // the decimal mark, as in the source

// ---------------------------------------------------------------------------------------- the data

const bytesOf = (base64) => {
  const text = atob(base64)
  const bytes = new Uint8Array(text.length)
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i)
  return bytes.buffer
}

const numbersOf = (base64) => new Float64Array(bytesOf(base64))

// The payload of the file as arrays; its numbers are little-endian float64 in base64.
function decode(payload) {
  const columns = payload.columns.map((column) => ({
    ...column,
    values: column.values === null ? null : numbersOf(column.values),
    label: column.name + (column.unit && !column.name.endsWith(`[${column.unit}]`) ? ` [${column.unit}]` : ""),
  }))
  const data = {
    ...payload,
    columns,
    objectives: columns.filter(({role}) => role === "objective"),
    by: new Map(), // a Map, as any name is one of its keys, also __proto__
    optimal: new Uint8Array(bytesOf(payload.optimal)), // among all
    more: [], // what `grow` has added
  }
  mark = payload.decimal ?? "."
  // A user's column goes before a geometric one of the same name.
  for (const column of [...columns].reverse()) data.by.set(column.name, column)
  return grow(data, payload.more ?? [])
}

// Add designs that came since, where there is no prototype: `names`, `labels` and the cells of columns.
function grow(data, more) {
  for (const {names, labels, columns} of more) {
    data.names.push(...names)
    data.labels.push(...labels)
    data.n = data.names.length
    columns.forEach(({texts, values}, j) => {
      const column = data.columns[j]
      const known = column.texts
      const places = texts?.map((text) => known.includes(text) ? known.indexOf(text) : known.push(text) - 1)
      const cells = numbersOf(values).map((cell) => places?.[cell] ?? cell)
      const all = new Float64Array(data.n)
      all.set(column.values)
      all.set(cells, column.values.length)
      Object.assign(column, {values: all, ends: null, isWhole: null}) // charts.js fills them in
    })
  }
  const {n, names, objectives} = data
  const all = new Uint8Array(names.length).fill(1)
  const F = objectives.map(({maximize, values}) => { // equal where they are equal up to rounding
    const {least, group} = grouped(maximize ? values.map((value) => -value) : values)
    return taken(least, group)
  })
  const dominator = new Int32Array(n).fill(-1)
  // What was found stays so, unless new values change which ones are equal up to rounding.
  const isSame = data.F?.every((column, j) => column.every((value, i) => value === F[j][i]))
  const {boxes, optimal, last} = isSame || !more.length ? data : {optimal: []}
  if (isSame) dominator.set(data.dominator)
  Object.assign(data, {
    F,
    total: names.length,
    designs: upTo(n),
    prototypes: upTo(names.length).subarray(n),
    rowOf: new Map(names.map((name, row) => [name, row])),
    dominator, // a dominator of each design, the one found last, see `frontOf`
    more: [...data.more, ...more],
    alphabetic: null,
    last, // the front before
  })
  if (more.length) {
    // What was dominated stays so; what was optimal is compared with the new designs only.
    const added = boxesOf(F, data.designs.subarray(optimal.length))
    const halves = boxes?.halves ?? []
    data.boxes = halves.length % 50 ? {low: [], rows: [], halves: [...halves, added]} : boxesOf(F, data.designs)
    data.optimal = Uint8Array.from(data.designs, (i) => optimal[i] !== 0 &&
      dominatorOf(optimal[i] ? added : data.boxes, F.map((column) => column[i]), all) < 0)
  }
  data.whole = ranked(data, all)
  if (more.length) for (const column of data.columns) if (column.range && column.values) {
    column.range = [1, -1].map((sign, k) => sign * min(sign * column.range[k], sign * endOf(column.values, sign, data.whole.front)))
  }
  data.fixed = fixedFrame(data) // the points U and N of fixed ranges
  return data
}

const values = (data, ranking, column) => column.role === "geometric" ? ranking[column.field] : column.values

// ------------------------------------------------------------------------ order, rounding, dominance

function upTo(n) {
  const rows = new Int32Array(n)
  for (let k = 0; k < n; k++) rows[k] = k
  return rows
}

// The rows that a function accepts; the filter of typed arrays takes five times as long.
let room = new Int32Array(0) // to pick into, as fresh memory costs more than the picking
function picked(rows, accepts) {
  if (room.length < rows.length) room = new Int32Array(rows.length)
  let count = 0
  for (let k = 0; k < rows.length; k++) if (accepts(rows[k])) room[count++] = rows[k]
  return room.slice(0, count)
}

// The values of some rows; Float64Array.from takes ten times as long.
function taken(values, rows, result = new Float64Array(rows.length)) {
  for (let k = 0; k < rows.length; k++) result[k] = values[rows[k]] + 0 // no -0
  return result
}

function concat(...lists) {
  const result = new Int32Array(sum(lists.map((list) => list.length)))
  lists.reduce((at, list) => { result.set(list, at); return at + list.length }, 0)
  return result
}

function sum(array) {
  let total = 0
  for (let k = 0; k < array.length; k++) total += array[k]
  return total
}
// The least of numbers (sign 1) or the greatest (-1), of all or of some rows; a loop, as reduce takes
// several times as long.
function endOf(array, sign, rows = null) {
  let end = Infinity
  if (rows) for (let k = 0; k < rows.length; k++) end = sign * array[rows[k]] < end ? sign * array[rows[k]] : end
  else for (let k = 0; k < array.length; k++) end = sign * array[k] < end ? sign * array[k] : end
  return sign * end + 0 // no -0
}
const leastOf = (array, rows) => endOf(array, 1, rows)

// The rows in the order of their values, missing ones last; equal ones stay as they are. They are
// sorted by the leading bits of their numbers first, as a comparing function takes thirty times as
// long and then has next to nothing left to do.
function argsort(values, rows) {
  const n = rows.length
  const keys = taken(values, rows)
  const words = new Int32Array(keys.buffer)
  const leading = new Uint32Array(n)
  for (let k = 0; k < n; k++) { // negative numbers are the lower, the larger their bits
    if (keys[k] !== keys[k]) keys[k] = Infinity
    leading[k] = words[2 * k + 1] < 0 ? ~words[2 * k + 1] : words[2 * k + 1] ^ 0x80000000
  }
  let order = upTo(n)
  for (const shift of [0, 11, 22]) {
    const [ends, next] = [new Int32Array(2049), new Int32Array(n)]
    for (let k = 0; k < n; k++) ends[((leading[k] >>> shift) & 2047) + 1]++
    for (let v = 1; v < 2049; v++) ends[v] += ends[v - 1]
    for (let k = 0; k < n; k++) next[ends[(leading[order[k]] >>> shift) & 2047]++] = order[k]
    order = next
  }
  for (let from = 0, to = 1; to <= n; to++) {
    if (to < n && leading[order[to]] === leading[order[from]]) continue
    if (to - from > 1) order.subarray(from, to).sort((a, b) => keys[a] - keys[b] || a - b)
    from = to
  }
  return taken(rows, order, new Int32Array(n))
}

// The least values of the groups of values that are equal up to rounding, ascending, and the group of
// each value. A group reaches from its least value, so that no chain is taken for one.
function grouped(values) {
  const least = []
  let reach = NaN
  const group = new Int32Array(values.length)
  for (const row of argsort(values, upTo(values.length))) {
    const value = values[row]
    if (!(value <= reach)) {
      least.push(value)
      reach = value + NOISE * abs(value)
    }
    group[row] = least.length - 1
  }
  return {least, group}
}

// The rows that no row left dominates, in ascending order. What is Pareto optimal among all is so
// among fewer; what is dominated stays so as long as the dominator found last is left, and what was
// optimal in the last call is compared only with rows that have come back since.
function frontOf(data, mask, rows) {
  const {optimal, dominator, last} = data
  if (rows.length === data.n) return picked(rows, (i) => optimal[i])
  const added = new Uint8Array(data.n)
  let more = 0
  if (last) for (let i = 0; i < data.n; i++) more += added[i] = mask[i] & ~last.mask[i]
  const front = new Uint8Array(data.n)
  for (let k = 0; k < rows.length; k++) {
    const i = rows[k]
    if (!optimal[i] && (dominator[i] < 0 || !mask[dominator[i]])) {
      data.boxes ??= boxesOf(data.F, data.designs)
      const stays = last?.front[i]
      dominator[i] = stays && !more ? -1 : dominatorOf(data.boxes, Float64Array.from(data.F, (column) => column[i]), stays ? added : mask)
    }
    front[i] = optimal[i] || dominator[i] < 0 ? 1 : 0
  }
  data.last = {mask: mask.slice(), front}
  return picked(rows, (i) => front[i])
}

// Find what dominates each design, one at a time, before a limit asks for all of them at once.
function* prepare(data) {
  const all = new Uint8Array(data.n).fill(1)
  for (let i = 0; i < all.length; i++) {
    if (data.optimal[i] || data.dominator[i] >= 0) continue
    data.boxes ??= boxesOf(data.F, data.designs)
    data.dominator[i] = dominatorOf(data.boxes, Float64Array.from(data.F, (column) => column[i]), all)
    yield
  }
}

// The rows in a tree of boxes, each with its least values and two halves, of the lower and the higher
// values of an objective; those of at most 32 rows have these and their objectives, row by row.
function boxesOf(F, rows, depth = 0) {
  const column = F[depth % F.length]
  const few = Float64Array.from({length: 15}, (_, k) => column[rows[floor(k * rows.length / 15)]])
  const middle = few.sort()[7]
  const lower = picked(rows, (i) => rows.length > 32 && column[i] < middle)
  // Equal in this objective: perhaps not in another.
  if (!lower.length && rows.length > 32 && depth < 50) return boxesOf(F, rows, depth + 1)
  const parts = lower.length ? [lower, picked(rows, (i) => !(column[i] < middle))] : []
  const own = lower.length ? rows.subarray(0, 0) : rows
  const points = new Float64Array(own.length * F.length)
  F.forEach((values, j) => own.forEach((row, k) => { points[k * F.length + j] = values[row] }))
  return {low: Float64Array.from(F, (values) => endOf(values, 1, rows)), rows: own, points,
    halves: parts.map((half) => boxesOf(F, half, depth + 1))}
}

// One of the rows among a mask that dominates a point; -1 if there is none. It lies in boxes whose
// least values are nowhere worse.
function dominatorOf({low, rows, points, halves}, point, among) {
  const m = point.length
  for (let j = 0; j < m; j++) if (low[j] > point[j]) return -1
  for (let k = 0; k < rows.length; k++) {
    if (!among[rows[k]]) continue
    let [j, better] = [0, false]
    for (; j < m && points[k * m + j] <= point[j]; j++) better ||= points[k * m + j] < point[j]
    if (j === m && better) return rows[k]
  }
  for (let k = 0; k < halves.length; k++) {
    const found = dominatorOf(halves[k], point, among)
    if (found >= 0) return found
  }
  return -1
}

// ------------------------------------------------------------------------------------------ places

// The points U and N of the front, or those of another frame, and what distances are measured in
// (pareto's UtopianFrame).
class Frame {
  constructor(F, front, normalize, fixed) {
    this.low = F.map((column) => endOf(column, 1, front))
    this.high = F.map((column) => endOf(column, -1, front))
    this.ideal = fixed?.ideal ?? this.low
    this.nadir = fixed?.nadir ?? this.high
    this.lengths = this.ideal.map((low, j) => { // infinite where the range is none
      const high = this.nadir[j]
      return high - low > NOISE * max(abs(low), abs(high)) ? high - low : Infinity
    })
    this.scale = normalize ? this.lengths : this.lengths.map(() => 1)
    this.line = this.lengths.map((length, j) =>
      isNumber(length) ? (this.nadir[j] - this.ideal[j]) / this.scale[j] : 0)
    // How large the values of each objective are in the scale.
    this.sizes = this.lengths.map((length, j) => !isNumber(length) ? 0 : max(
      ...[this.low, this.high, this.ideal, this.nadir].map((point) => abs(point[j]))) / this.scale[j])
    const most = max(...this.line) || 1
    const norm = sqrt(sum(this.line.map((value) => (value / most) ** 2))) || 1
    this.direction = this.line.map((value) => value / most / norm)
  }

  // Three arrays of `size`, μ1 to μ3 of some rows of F and NaN elsewhere, and their units, in which
  // no square over- or underflows.
  measured(F, rows, size) {
    const {ideal, scale, line, direction: e} = this
    const longest = line.indexOf(max(...line))
    const unit = line[longest] || 1
    const acrossUnit = max(0, ...line.filter((_, j) => j !== longest)) || unit
    const [perUnit, perAcross] = [1 / unit, 1 / acrossUnit]
    const mu = [0, 1, 2].map(() => new Float64Array(size).fill(NaN))
    const [mu1, mu2, mu3] = mu
    const m = F.length
    const d = new Float64Array(m)
    for (let k = 0; k < rows.length; k++) {
      const i = rows[k]
      for (let j = 0; j < m; j++) d[j] = (F[j][i] - ideal[j]) / scale[j]
      const share = d[longest] * perUnit
      let along = 0
      for (let j = 0; j < m; j++) along += (d[j] - share * line[j]) * e[j]
      let [square, squareAcross, onLine] = [0, 0, 0]
      for (let j = 0; j < m; j++) {
        const across = (d[j] - share * line[j] - along * e[j]) * perAcross
        const whole = d[j] * perUnit
        square += whole * whole
        squareAcross += across * across
        onLine += whole * e[j]
      }
      mu1[i] = square === square ? sqrt(square) : Infinity // no call, which would make objects
      mu2[i] = squareAcross === squareAcross ? sqrt(squareAcross) : Infinity
      mu3[i] = onLine === onLine ? onLine : Infinity
    }
    return [mu, [unit, acrossUnit, unit]]
  }

  // The rounding error of μ1 in its unit.
  noise(unit) {
    return LAST_PLACES * hypot(...this.sizes.map((size) => size / unit))
  }
}

// The ranking of the rows left (pareto's rank_of_efficiency), with the points U and N of another
// frame if one is given.
//   mask, rows, count     what was ranked, without prototypes
//   front, byPlace        the Pareto-optimal rows, and these by place
//   pareto, place         by row; only Pareto-optimal rows have a place, others have 0
//   mu1, mu2, mu3         by row, of prototypes too
//   ideal, nadir          in the original direction
//   best                  the rows of the Salukvadze optimum, which have place 1
//   frame                 the points U and N
function ranked(data, mask, fixed = null) {
  const {n, total, F} = data
  const rows = picked(data.designs, (i) => mask[i])
  const pareto = new Uint8Array(total)
  const front = rows.length ? frontOf(data, mask, rows) : rows
  const frame = new Frame(F, front, data.normalize, fixed)
  const all = rows.length ? concat(rows, data.prototypes) : rows
  const [mu, units] = frame.measured(F, all, total)
  for (let k = 0; k < front.length; k++) pareto[front[k]] = 1
  const {byPlace, place} = placed(front, mu[0], frame.noise(units[0]))
  const best = [...picked(front, (i) => place[i] === 1)]
  mu.forEach((column, k) => {
    for (let at = 0; at < all.length; at++) column[all[at]] *= units[k]
  })
  const turned = (point) => point.map((value, j) => (data.objectives[j].maximize ? -value : value) + 0)
  return {mask, rows, count: rows.length, front, byPlace, pareto, place, mu1: mu[0], mu2: mu[1], mu3: mu[2],
    ideal: turned(frame.ideal), nadir: turned(frame.nadir), best, frame, fixed}
}

// The places of the Pareto-optimal rows, by row: 1 and the number of those that are nearer to the
// ideal; rows that are equally near, up to rounding, share one. And the rows in this order.
function placed(front, mu1, noise) {
  const byPlace = argsort(mu1, front)
  const place = new Int32Array(mu1.length)
  let [from, reach] = [0, -Infinity]
  const close = (to) => { if (to - from > 1) byPlace.subarray(from, to).sort() }
  byPlace.forEach((row, k) => {
    if (mu1[row] > reach) {
      close(k)
      from = k
      reach = mu1[row] + noise
    }
    place[row] = from + 1
  })
  close(byPlace.length)
  return {byPlace, place}
}

// ------------------------------------------------------------------------------------------ limits

// The designs within all limits, and what each limit rejects. A value that is missing keeps none.
//   mask, count  prototypes are always in the mask and never counted
//   rejected     by name of the column, which designs its limit rejects
//   times        by how many limits a design is rejected
function left(data, state) {
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
  const times = new Uint32Array(n)
  for (const out of rejected.values()) for (let i = 0; i < n; i++) times[i] += out[i]
  const mask = new Uint8Array(total).fill(1)
  for (let i = 0; i < n; i++) mask[i] = times[i] ? 0 : 1
  return {mask, count: sum(mask) - (total - n), rejected, times}
}

const limitText = ({name, unit}, end, value) =>
  `${name} ${end ? "at most" : "at least"} ${apart(local(String(value)))}${unit ? ` ${unit}` : ""}`

// A value with six digits, rounded up or down.
function inSixDigits(value, isUp) {
  if (value === 0 || !isNumber(value)) return value
  const near = Number(value.toPrecision(6))
  if (isUp ? near >= value : near <= value) return near
  return Number((near + (isUp ? 1 : -1) * 10 ** (floor(log10(abs(value))) - 5)).toPrecision(6))
}

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
      const free = looser ? left(data, {...state, limits: {...state.limits, [name]: pair.map((limit, k) => (k === end ? null : limit))}}) : now
      const rows = isWorse ? looser ? ranked(data, free.mask).front : now.front : picked(data.designs, (i) => free.mask[i])
      const sign = end ? 1 : -1
      const known = taken(values, rows).map((value) => sign * value)
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

// The same in a sentence for tighter and one for looser limits, "" if the proposal stays at any limit.
function staying(data, now, found) {
  if (!now.best.length) return ""
  return ["tighter", "looser"].map((direction) => {
    const changes = found.filter((one) => one.value !== null && one.looser === (direction === "looser")).map(({name, end, looser, value, row}) => {
      const {unit} = data.by.get(name)
      return sentence(data, `${end ? "upper" : "lower"} ${direction}`, {column: name,
        other: row < 0 ? sentence(data, "none", {}) : sentence(data, "other", {design: data.names[row]}),
        limit: `${short(inSixDigits(value, looser === (end === 1)), 6)}${unit ? ` ${unit}` : ""}`})
    })
    return changes.length ? sentence(data, direction, {changes: changes.join("; ")}) : ""
  }).filter(Boolean).join(" ")
}

// ------------------------------------------------------------------------------------- the orders

// The rows shown, prototypes first, then the best design first; dominated designs come last but
// where they are sorted by a column. "distance" is by place.
function order(data, ranking, state) {
  const {by, name, down} = state.order
  const {pareto, byPlace} = ranking
  const turned = (list) => (down ? list.slice().reverse() : list)
  if (by === "column" || by === "label") {
    const column = by === "label" ? null : data.by.get(name)
    const array = column ? values(data, ranking, column) : data.alphabetic ??= alphabetic(data)
    const sorted = argsort(array, state.dominated ? ranking.rows : ranking.front)
    const known = picked(sorted, (i) => !Number.isNaN(array[i]))
    return concat(data.prototypes, turned(known), picked(sorted, (i) => Number.isNaN(array[i]))) // missing ones last
  }
  const dominated = state.dominated ? picked(ranking.rows, (i) => !pareto[i]) : new Int32Array(0)
  if (by === "preference") {
    const {value, total, best} = preference(data, ranking, state.preference)
    const others = picked(ranking.front, (i) => !best.includes(i))
    const ordered = concat(best, argsort(value, argsort(total, others)))
    return concat(data.prototypes, turned(ordered), turned(argsort(value, dominated)))
  }
  return concat(data.prototypes, turned(byPlace), turned(argsort(ranking.mu1, dominated)))
}

// The rows that a search finds by a part of a name or a text, whatever the limits, those shown first.
function found(data, text, shown) {
  if (!text) return shown
  const fits = (cell) => cell.toLowerCase().includes(text.toLowerCase())
  const columns = data.columns.filter(({texts}) => texts)
  const exact = data.rowOf.has(text) ? [data.rowOf.get(text)] : []
  return Int32Array.from([...new Set([...exact, ...shown, ...data.names.keys()])].filter((row) =>
    fits(data.names[row]) || columns.some(({texts, values}) => fits(texts[values[row]]))))
}

// The places of the names in the order of a dictionary, in which 9 comes before 10.
function alphabetic({names}) {
  const {compare} = new Intl.Collator(undefined, {numeric: true})
  const places = new Float64Array(names.length)
  names.map((_, row) => row).sort((a, b) => compare(names[a], names[b])).forEach((row, k) => { places[row] = k })
  return places
}

// The achievement function of every row left, max w (f - r) / range, the least of which is chosen,
// and the sum of its terms, which decides ties (selection's ReferencePoint). Without an aspiration
// an objective is measured from its best value; weights are 1 unless given.
function preference(data, ranking, {weights, aspiration}) {
  const {objectives} = data
  const value = new Float64Array(data.total).fill(NaN)
  const total = value.slice()
  if (ranking.count === 0) return {value, total, best: []}
  const {frame, front} = ranking
  const given = objectives.map(({name}) => (Object.hasOwn(weights, name) ? weights[name] : 1))
  const most = max(...given)
  const ratios = given.map((weight) => (most > 0 ? weight / most : 1))
  const w = ratios.map((ratio) => ratio / sum(ratios))
  const point = objectives.map(({name, maximize}, j) => {
    if (!Object.hasOwn(aspiration, name)) return frame.ideal[j]
    return maximize ? -aspiration[name] : aspiration[name]
  })
  const measure = (row) => {
    let greatest = -Infinity
    let all = 0
    for (let j = 0; j < w.length; j++) {
      const term = w[j] * ((data.F[j][row] - point[j]) / frame.scale[j])
      if (term > greatest) greatest = term
      all += term
    }
    value[row] = greatest
    total[row] = all
  }
  concat(ranking.rows, data.prototypes).forEach(measure)
  const noise = frame.sizes.map((size, j) =>
    LAST_PLACES * w[j] * max(size, abs(point[j] / frame.scale[j])))
  const nearest = (list, key, tolerance) => {
    const reach = leastOf(list.map((i) => key[i])) + tolerance
    return list.filter((i) => key[i] <= reach)
  }
  const best = nearest(nearest([...front], value, max(...noise)), total, sum(noise))
  return {value, total, best}
}

// ----------------------------------------------------------------------------------------- wording

const sentence = (data, name, parts) =>
  data.sentences[name].replace(/\{(\w+)\}/g, (_, part) => parts[part])

// A name that the user gave stays as it is.
const capital = (text) => text.replace(/^(design|row|test) /, (ours) => ours[0].toUpperCase() + ours.slice(1))
const listed = (names, word = "and") =>
  names.length > 1 ? `${names.slice(0, -1).join(", ")} ${word} ${names.at(-1)}` : names.join("")
const counted = (n, one) => `${apart(String(n))} ${one}${n === 1 ? "" : "s"}`

// The digits of a number as Python rounds them, an exact half to the even digit: 62.5 -> 6.2e+1.
function rounded(value, digits) {
  const up = value.toExponential(digits - 1) // an exact half is rounded up
  if (!value.toExponential(digits).includes("5e")) return up // all digits take long
  const [mantissa, exponent] = abs(value).toExponential(60).split("e")
  const all = mantissa.replace(".", "")
  const half = all[digits] === "5" && /^0*$/.test(all.slice(digits + 1))
  if (!half || Number(all[digits - 1]) % 2) return up
  return `${value < 0 ? "-" : ""}${all[0]}.${all.slice(1, digits)}e${exponent}`
}

// A positive number as a whole one; an exact half goes to the even number.
function whole(size) {
  const down = floor(size)
  return size - down === 0.5 ? down + down % 2 : round(size)
}

// A number with a few digits, none lost before the point; from five on thousands are apart, as in Python.
function short(value, digits = 4) {
  if (value === 0 || !isNumber(value)) return String(value).replace("Infinity", "inf")
  const size = abs(value)
  if (size < 1e9 && (size >= 10 ** digits - 0.5 || Number.isInteger(value))) {
    return (value < 0 ? "-" : "") + apart(String(whole(size)))
  }
  const text = rounded(value, digits)
  const [mantissa, power] = text.split("e").map(Number)
  if (power >= -4 && power < digits) {
    return apart(local(Number(text).toFixed(max(0, digits - 1 - power)).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "")))
  }
  return `${local(String(mantissa))}e${power}`
}
const local = (text) => text.replace(".", mark)
const apart = (text) => text.replace(/^-?\d{5,}/, (whole) => whole.replace(/\B(?=(\d{3})+$)/g, "\u00a0"))

// A share with two digits, above 10 % with none behind the point.
function percent(share) {
  const hundreds = 100 * share
  if (hundreds > 0 && hundreds < 0.01) return local("less than 0.01 %")
  if (hundreds >= 99.95 && hundreds < 100 - 1e-7) return local("more than 99.9 %")
  if (hundreds >= 99.5 && hundreds < 99.95) return `${local(rounded(hundreds, 3).replace(/^(.)\.(.)(.).*/, "$1$2.$3"))} %`
  if (!(hundreds >= 9.95) || hundreds === Infinity) return `${short(hundreds, 2)} %`
  return `${BigInt(whole(hundreds))} %` // all digits of any
}

// What a design is under the limits.
function placeText(data, {mask, pareto, place}, row) {
  if (row >= data.n) return "prototype"
  if (!mask[row]) return "outside the limits"
  return pareto[row] ? `place ${place[row]}` : "dominated"
}

// A number with the digits that tell designs of its column apart; a text is itself.
function written(column, value) {
  if (column.texts) return column.texts[value] || "–"
  if (value === null || Number.isNaN(value)) return "–"
  if (!isNumber(value)) return value > 0 ? "∞" : "-∞"
  const {decimals, powers} = column.notation
  // Values beyond the range of the column, penalties perhaps, have no place in its notation.
  if (powers || abs(value) >= 1e7) return value === 0 ? "0" : local(rounded(value, 1 + (powers ? decimals : 3)).replace("+", ""))
  const significant = decimals + 1 + floor(log10(abs(value)))
  const even = significant > 0 ? Number(rounded(value, significant)) : value // toFixed rounds a half up
  return apart(local(even.toFixed(decimals).replace(/^-(?=[0.]*$)/, ""))) // no -0
}

// ------------------------------------------------------------------------------------- explanations

// A share that is given in per cent: where the range is 0, or ends before, only units tell.
const isWithin = (share) => abs(share) <= 1 + TIE

// A difference of values in their unit; of per cent it is points.
const amount = ({unit}, value) => short(value, 3) + (unit === "%" ? " points" : unit ? ` ${unit}` : "")

// The objectives by share, the largest first, NaN last.
function bySize(shares) {
  const sizes = shares.map((share) => (Number.isNaN(share) ? -1 : round(abs(share) / TIE)))
  return shares.map((_, j) => j).sort((a, b) => sizes[b] - sizes[a] || a - b)
}

// Where a design is better than another and where worse, in words.
function difference(data, gains, shares) {
  const places = bySize(shares)
  const [better, worse] = [1, -1].map((sign) => listed(places.filter((j) => sign * gains[j] > 0).map((j) => {
    const column = data.objectives[j]
    return sentence(data, (gains[j] > 0) === column.maximize ? "higher" : "lower", {objective: column.name, amount: amount(column, abs(gains[j]))})
  })))
  return better && worse ? sentence(data, "mixed", {better, worse}) : better || worse || sentence(data, "equal", {})
}

// Gains of rows against the first of them and shares of the ranges, a list each.
function gainsOf(data, {frame}, rows) {
  const gains = rows.map((row) => data.F.map((column) => column[rows[0]] - column[row] + 0))
  return {gains, shares: gains.map((list) => list.map((gain, j) => shareOf(gain, frame.lengths[j])))}
}

const shareOf = (difference, length) =>
  length === Infinity && difference !== 0 ? NaN : difference / length + 0

function against(data, ranking, key, row, other, parts = {}) {
  const {gains, shares} = gainsOf(data, ranking, [other, row])
  const name = data.names[row]
  const design = data.sentences[key].startsWith("{design}") ? capital(name) : name
  return sentence(data, key, {design, other: data.names[other], difference: difference(data, gains[1], shares[1]), ...parts})
}

// The rows to compare, the base first: the existing design, or else the best. Beside it stand the
// best, the chosen one, the one looked at and what is pinned, and the designs nearest to the one
// looked at, so that there are four. Each: `{row, roles}`.
function compared(data, ranking, state, shown = -1) {
  if (ranking.count === 0) return []
  const row = (name) => data.rowOf.get(name) ?? -1
  const best = ranking.best[0]
  const chosen = row(state.chosen)
  const base = data.total > data.n ? data.n : best
  const looked = shown >= 0 ? shown : chosen >= 0 ? chosen : best
  const rows = new Set([base, best, chosen, looked, ...state.pins.map(row)].filter((i) => i >= 0))
  const near = nearest(data, ranking, looked, rows, 4 - rows.size)
  const roles = [[base, "base"], [best, "proposed"], [chosen, "chosen"], ...near.map((i) => [i, "near"])]
  return [...rows, ...near].map((i) => ({
    row: i, roles: roles.filter(([one]) => one === i).map(([, role]) => role),
  }))
}

// Some rows of the front that are nearest to a row, in units of the ranges, but for those taken.
function nearest(data, {front, frame}, row, taken, count) {
  const away = new Float64Array(front.length)
  data.F.forEach((column, j) => {
    const [own, length] = [column[row], frame.lengths[j]]
    for (let k = 0; k < away.length; k++) away[k] += ((column[front[k]] - own) / length) ** 2
  })
  for (let k = 0; k < away.length; k++) if (taken.has(front[k])) away[k] = Infinity
  const found = []
  for (let least = leastOf(away); found.length < count && least < Infinity; least = leastOf(away)) {
    const at = away.indexOf(least)
    found.push(front[at])
    away[at] = Infinity
  }
  return found
}

// What rows gain against one of them in each objective, and this in shares of its range.
function compare(data, ranking, rows, base) {
  const {gains, shares} = gainsOf(data, ranking, [base, ...rows])
  return data.objectives.map((column, j) => ({column, gains: rows.map((_, k) => gains[k + 1][j]),
    shares: rows.map((_, k) => shares[k + 1][j])}))
}

// Why a design: its distances from the best, and towards each objective the design that gives up
// least (pareto's explain). Any row, also dominated or a prototype.
function explain(data, ranking, row) {
  const {front, frame: {low, lengths}, pareto} = ranking
  const {objectives, F} = data
  const own = F.map((column) => column[row])
  const behind = own.map((value, j) => value - low[j])
  const shares = behind.map((value, j) => shareOf(value, lengths[j]))
  const loss = new Float64Array(front.length) // the greatest in an objective, in units of the ranges
  F.forEach((column, j) => {
    const [value, length] = [own[j], lengths[j]]
    for (let k = 0; k < loss.length; k++) {
      const d = column[front[k]] - value
      if (d > 0 && d / length > loss[k]) loss[k] = d / length
    }
  })
  const distance = (k) => sqrt(sum(F.map((column, j) => ((column[front[k]] - own[j]) / lengths[j]) ** 2)))
  // The nearest of some; among those that tie, the least by a key.
  const nearest = (some, key) => {
    const away = Float64Array.from(some, distance).map((value) => (Number.isNaN(value) ? Infinity : value))
    const reach = leastOf(away) * (1 + TIE)
    return some.filter((_, k) => away[k] <= reach).reduce((a, b) => (key(b) < key(a) ? b : a))
  }
  const neighbours = F.map((column, j) => {
    const leastLosses = (step) => { // the places of those that gain so much
      let [some, reach] = [[], Number.MAX_VALUE]
      for (let k = 0; k < loss.length; k++) {
        if (!(loss[k] <= reach && column[front[k]] < own[j] && own[j] - column[front[k]] >= step)) continue
        reach = min(reach, loss[k] + TIE)
        some.push(k)
      }
      return some.filter((k) => loss[k] <= reach)
    }
    const some = [STEP * lengths[j], 0].map(leastLosses).find((list) => list.length)
    return some ? front[nearest(some, (k) => column[front[k]])] : -1
  })
  const least = leastOf(loss)
  const dominatedBy = pareto[row] ? -1 : front[nearest(picked(upTo(front.length), (k) => loss[k] === least), (k) => loss[k])]
  const ordered = bySize(shares)
  const most = max(0, ...shares.filter((share) => !Number.isNaN(share)))
  const weakest = objectives.filter((_, j) => most > 0 && shares[j] >= most * (1 - TIE)).map(({name}) => name)
  const steps = [] // a neighbour towards several objectives is one step
  for (const j of ordered.filter((j) => neighbours[j] >= 0)) {
    const same = steps.find((step) => step.row === neighbours[j])
    if (same) same.names.push(objectives[j].name)
    else steps.push({names: [objectives[j].name], row: neighbours[j]})
  }
  const {gains, shares: gained} = gainsOf(data, ranking, [row, ...steps.map((step) => step.row)])
  steps.forEach((step, k) => { step.text = difference(data, gains[k + 1], gained[k + 1]) })
  return {
    row,
    objectives: objectives.map(({name, values, maximize}, j) => ({
      name, value: values[row], best: maximize ? -low[j] : low[j], away: behind[j], share: shares[j],
    })),
    weakest,
    steps,
    standing: standing(data, ranking, row, dominatedBy),
  }
}

function standing(data, ranking, row, dominatedBy) {
  const {front, best, place, mask, frame} = ranking
  const design = data.names[row]
  if (row >= data.n) return `${capital(design)} is not among the designs that are ranked.`
  if (!mask[row]) return `${capital(design)} is beyond the limits.`
  if (dominatedBy >= 0) {
    const {gains, shares} = gainsOf(data, ranking, [row, dominatedBy])
    return sentence(data, "dominated", {design: capital(design), other: data.names[dominatedBy], difference: difference(data, gains[1], shares[1])})
  }
  if (front.length === 1) return sentence(data, "single", {design})
  const names = data.objectives.filter((_, j) => frame.lengths[j] < Infinity && data.F[j][row] === frame.low[j]).map(({name}) => name)
  const parts = {best: names.length ? sentence(data, "best", {objectives: listed(names)}) : "", count: best.length, place: place[row], front: front.length}
  if (place[row] > 1) return sentence(data, "ranked", {...parts, design: capital(design)})
  return sentence(data, best.length === 1 ? "optimum" : "optima", {...parts, design})
}

// What is to be looked at first: the chosen design, or else the best compromise, which is proposed;
// null if nothing is left and none is chosen.
//   proposed   the row of the best compromise, or -1
//   instead    chosen against proposed, as a sentence; "" where they are one
//   remarks    what a reader must know of it
function verdict(data, ranking, chosen, key = "instead") {
  const proposed = ranking.best[0] ?? -1
  const row = chosen >= 0 ? chosen : proposed
  if (row < 0 || !ranking.count) return null
  const found = explain(data, ranking, row)
  const first = data.whole.best[0]
  const remarks = []
  if (ranking.place[first] !== 1) {
    remarks.push(against(data, ranking, ranking.mask[first] ? "moved" : "without limits", first, proposed))
  }
  const isProposed = ranking.place[row] === 1
  return {...found, proposed, remarks, instead: isProposed ? "" : against(data, ranking, key, row, proposed)}
}

// ------------------------------------------------------------------------------------ typed numbers

// A number as a reader typed it: {value}, which is null for nothing, or {wrong}, what to type instead.
// Points and commas are decimal marks, but where one that is not the page's may separate thousands, as
// spaces do.
function typed(text) {
  const other = mark === "." ? "," : "."
  const plain = text.trim().replace(/[−–]/g, "-").replace(/(?<=^[+-]?\d[\d\s]*)\s(?=\d{3}(?!\d))/g, "")
    .replace(/^[+-]?[1-9]\d{0,2}(([.,])\d{3})+(?!\2)[.,]\d*$/, (number, _, gap) => number.replaceAll(gap, ""))
  if (plain === "") return {value: null}
  if (!/^[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?$/i.test(plain)) return {wrong: "Enter a number such as 1.5 or 2e3."}
  if (new RegExp(`^[+-]?[1-9]\\d{0,2}\\${other}\\d{3}$`).test(plain)) {
    return {wrong: `${plain.replace(other, mark)} or ${plain.replace(other, "")}? Enter one of them.`}
  }
  const value = Number(plain.replace(",", "."))
  return isNumber(value) ? {value} : {wrong: "Enter a number below 1e308."}
}

// ------------------------------------------------------------------------------------------ states

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value)

const entryOf = (object, name) =>
  isObject(object) && Object.hasOwn(object, name) ? object[name] ?? undefined : undefined

// Objects by the user's names have no prototype: in them __proto__ is a name as any other.
const byName = (entries = []) => {
  const object = Object.create(null)
  for (const [name, value] of entries) object[name] = value
  return object
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
  const kept = (key, fits) => (item) => fits(item) || (lost.add(key), false)
  const entries = (key, fits, object) => byName(entriesOf(fitting(key, isObject, {}, object)).filter(
    kept(key, ([name, value]) => data.by.get(name)?.name === name && fits(data.by.get(name), value))))
  const items = (key, fits) => [...new Set(fitting(key, Array.isArray, []).filter(kept(key, fits)))]
  const isDesign = (name) => typeof name === "string" && data.rowOf.has(name)
  const isPair = (pair) => Array.isArray(pair) && pair.length === 2 && pair.some((end) => end !== null) &&
    pair.every((end) => end === null || isNumber(end)) && !(pair.every(isNumber) && pair[0] > pair[1])
  const isObjective = ({role}) => role === "objective"
  const isText = (value) => typeof value === "string"
  // What somebody holds at a date, checked as a state is.
  const position = (one) => {
    const {state: {limits, chosen, reason, preference}, remarks} = checked(data, {limits: one.limits, chosen: one.chosen,
      reason: one.reason, preference: {weights: one.weights, aspiration: one.aspiration}})
    if (remarks.length) lost.add("positions")
    const [name, date] = [one.name, one.date].map((text) => (isText(text) ? text.slice(0, 60) : ""))
    return {name, date, chosen, limits, ...preference, reason}
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
    pins: items("pins", isDesign).slice(0, MOST_PINS),
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
    reason: fitting("reason", (text) => typeof text === "string", "").slice(0, 10000),
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

// ------------------------------------------------------------------------------------------- files

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
function csv(data, rows, ranking, state) {
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
  const text = (value) => (Number.isNaN(value) ? "" : quoted(inert(String(value))))
  const cells = data.columns.map((column) => {
    const array = values(data, ranking, column)
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

// Ranges in which distances are measured whatever the limits, by name, in increasing order: those
// that the page was made with, or those of all designs.
const isFixed = (ranges) => isObject(ranges) && Object.keys(ranges).length > 0
function fixedFrame({objectives, opens_with: {ranges}, whole}) {
  if (!isFixed(ranges)) return whole.frame
  const [low, high] = [0, 1].map((end) => objectives.map(({name, maximize}) =>
    maximize ? -ranges[name][1 - end] : ranges[name][end]))
  return {ideal: low, nadir: high}
}
const rangesOf = (data, {fixed}) => !fixed ? {} : byName(data.objectives.map(({name, maximize}, j) => {
  const ends = [data.fixed.ideal[j], data.fixed.nadir[j]].map((value) => (maximize ? -value : value))
  return [name, maximize ? ends.reverse() : ends]
}))

// The decision as a formulation in JSON, for people, the page and the commands (table's Formulation);
// what only the page knows stands under "page". Nothing is chosen that nobody has chosen.
function decision(data, state, date) {
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

const initial = (data) => decided(data, data.opens_with)

// The state that a decision file holds, or null if it is about something else.
function opened(data, text) {
  const content = parsed(text)
  const {objectives, maximize, normalize, units, ranges, page} = isObject(content) ? content : {}
  const own = data.opens_with
  const same = (list, names) => Array.isArray(list) && JSON.stringify([...list].sort()) === JSON.stringify([...names].sort())
  const unlike = data.columns.find(({name, unit}) => unit && (entryOf(units, name) ?? unit) !== unit)
  const refused = !isObject(page) ? "it is not a decision saved by a page"
    : !same(objectives, own.objectives) || !same(maximize, own.maximize) ? "it has other objectives or directions"
    : unlike ? `its unit of ${unlike.name} differs`
    : normalize !== data.normalize ? "it measures distances differently (normalize)"
    : isFixed(ranges) && entriesOf(rangesOf(data, {fixed: true})).some(([name, ends]) =>
      String(entryOf(ranges, name)) !== String(ends)) ? "it has other fixed ranges" : ""
  return refused ? {state: null, remarks: [`The file cannot be opened: ${refused}.`]} : decided(data, content)
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

// The state of a formulation, and what a reader must know of it.
function decided(data, {limits, chosen, reason, ranges, positions, decided, page: {values, state: view}}) {
  const {state, remarks} = checked(data, {...view, fixed: isFixed(ranges), limits, chosen, reason, positions, decided})
  const row = data.rowOf.get(state.chosen)
  const changes = data.objectives.filter((column) => row !== undefined && isObject(values) &&
    entryOf(values, column.name) !== column.values[row])
  if (changes.length) {
    remarks.unshift(`${capital(state.chosen)} has changed since then in ${listed(changes.map(({name}) => name))}.`)
  }
  return {state, remarks}
}

return {
  decode, grow, prepare, initial, checked, parsed, values, left, ranked, order, found, preference, verdict, explain,
  compared, compare, limitText, switches, staying, latest, separation, sentence, listed, typed, written, short, placeText, amount, isWithin, apart, local, percent, picked, sum, endOf,
  csv, metadata, decision, opened, MOST_PINS,
}
})()

if (typeof module !== "undefined") module.exports = Logic
