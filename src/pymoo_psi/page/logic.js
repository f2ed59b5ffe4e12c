// The logic of the decision page: which designs are left under the limits, their ranks, the verdict,
// comparisons, states and files. It touches no document, so that it runs in the page and in Node.
//
// Designs are rows 0 … data.n - 1, existing designs (prototypes) the rows behind, up to data.total.
// All arrays have one entry a row. Objectives in data.F are minimised, as in Python; values of a
// column, limits, states and sentences are in the user's own sense and unit.
//
// What is ranked, told and chosen here equals what pymoo_psi.pareto and pymoo_psi.selection give for
// the same rows; the functions name the module that they follow.
const Logic = (() => {
"use strict"

const EPS = Number.EPSILON
const NOISE = 64 * EPS // of pareto/_rounding.py, where the reasons are
const LAST_PLACES = 8 * EPS
const TIE = 1e-9 // of pareto/_explanation.py
const STEP = 0.01
const PARTS = 64 // of each criterion's order, see `Dominators`: 32 to 256 are as fast, more take memory
const BAD = 0.5 // a weakest criterion beyond the middle of its range is worth a warning
const MOST_PINS = 5
const RANKS = [0, 1, 2, 3, 4, 5, 6]
const LONGEST_STATE = 1 << 20 // characters; browsers keep addresses of so many

// ---------------------------------------------------------------------------------------- the data

const bytesOf = (base64) => {
  const text = atob(base64)
  const bytes = new Uint8Array(text.length)
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i)
  return bytes.buffer
}

// The payload of the file as arrays. Its numbers are float64, int32 of little-endian bytes in base64.
function decode(payload) {
  const columns = payload.columns.map((column) => ({
    ...column,
    values: column.values === null ? null : new Float64Array(bytesOf(column.values)),
    label: column.name + (column.unit ? ` [${column.unit}]` : ""),
  }))
  const criteria = columns.filter((column) => column.role === "criterion")
  const {n, prototypes, ids} = payload
  const data = {
    ...payload,
    columns,
    criteria,
    ids: ids ?? payload.labels.map(String),
    total: n + prototypes,
    by: new Map(), // a Map, as any name is one of its keys, also __proto__
    F: criteria.map(({maximize, values}) => (maximize ? values.map((value) => -value) : values)),
    witness: new Int32Array(bytesOf(payload.witness)),
  }
  // A user's column goes before a geometric one of the same name.
  for (const column of [...columns].reverse()) data.by.set(column.name, column)
  data.rowOf = new Map(data.ids.map((id, row) => [id, row]))
  data.levels = new Levels(data.F)
  data.dominators = null // made when a search is needed, see `frontOf`
  data.latest = data.witness.slice() // the dominator found last, see `frontOf`
  data.last = null // the ranking before
  data.whole = ranked(data, new Uint8Array(data.total).fill(1))
  return data
}

// The values of any column, of a geometric one those under the limits.
const values = (data, ranking, column) =>
  column.role === "geometric" ? ranking[column.field] : column.values

// What a design is called in a sentence: a label that is a text stands for itself.
function called(data, row) {
  const id = data.ids[row]
  const kind = data.label_name.replaceAll("_", " ")
  return row >= data.n || !/^\d+( #\d+)?$/.test(id) ? id : `${kind} ${id}`
}

// ------------------------------------------------------------------------ order, rounding, dominance

// The rows in the order of their values, NaN last; equal ones stay as they are.
//
// A radix sort of the bits: a comparing function takes ten times as long for 100 000 rows. The upper
// halves of the numbers tell nearly all apart; what they leave in disorder is mended by insertion,
// or if that is much, the lower halves are sorted before.
function argsort(values, rows) {
  const n = rows.length
  const numbers = new Float64Array(n)
  for (let k = 0; k < n; k++) numbers[k] = values[rows[k]] + 0 // + 0: -0 equals 0
  const words = new Uint32Array(numbers.buffer)
  let [places, next] = [new Uint32Array(n), new Uint32Array(n)]
  const keys = new Uint32Array(n)
  const ends = new Uint32Array(1 << 11)
  for (const halves of [[1], [0, 1]]) {
    for (let k = 0; k < n; k++) places[k] = k
    for (const half of halves) {
      for (let k = 0; k < n; k++) {
        // As unsigned integers floats stand in order once negative ones are turned, others lifted.
        const high = words[2 * k + 1]
        const mask = high >>> 31 === 0 ? half << 31 : numbers[k] === numbers[k] ? -1 : 0
        keys[k] = words[2 * k + half] ^ mask
      }
      for (const shift of [0, 11, 22]) { // 11 bits at a time: so many lists fit into a cache
        ends.fill(0)
        for (let k = 0; k < n; k++) ends[(keys[k] >>> shift) & 2047]++
        if (ends[(keys[0] >>> shift) & 2047] === n) continue // the same in all
        for (let d = 0, sum = 0; d < ends.length; d++) {
          const count = ends[d]
          ends[d] = sum
          sum += count
        }
        for (let k = 0; k < n; k++) next[ends[(keys[places[k]] >>> shift) & 2047]++] = places[k]
        ;[places, next] = [next, places]
      }
    }
    if (halves.length > 1 || mended(places, numbers)) break
  }
  const result = new Int32Array(n)
  for (let k = 0; k < n; k++) result[k] = rows[places[k]]
  return result
}

// Sort places that are nearly in order by insertion; false if it would take long.
function mended(places, numbers) {
  let moves = 4 * places.length
  for (let k = 1; k < places.length; k++) {
    const place = places[k]
    const number = numbers[place]
    let at = k
    for (; at > 0 && numbers[places[at - 1]] > number; at--) {
      places[at] = places[at - 1]
      if (--moves < 0) return false
    }
    places[at] = place
  }
  return true
}

const upTo = (n) => Int32Array.from({length: n}, (_, i) => i)

// The rows from 0 to n - 1 that are marked.
function rowsOf(marks, n = marks.length) {
  const rows = new Int32Array(n)
  let count = 0
  for (let i = 0; i < n; i++) if (marks[i] !== 0) rows[count++] = i
  return rows.slice(0, count)
}

// The rows that a function accepts; the filter of typed arrays takes five times as long.
function picked(rows, accepts) {
  const result = new Int32Array(rows.length)
  let count = 0
  for (let k = 0; k < rows.length; k++) if (accepts(rows[k])) result[count++] = rows[k]
  return result.slice(0, count)
}

// How far a group of equal values reaches from its least one (pareto/_rounding.py).
const reachOf = (least, tolerance) =>
  Math.abs(least) === Infinity ? least : Math.min(least + tolerance, Number.MAX_VALUE)

// Number values from 0 upwards, those within a tolerance of the least of their group alike. `order`
// are the rows by value; `tolerance` null means the noise of the values. Fills `numbers` by row.
function numbered(values, order, tolerance, numbers) {
  let group = -1
  let reach = -Infinity
  for (let k = 0; k < order.length; k++) {
    const value = values[order[k]]
    if (value > reach || k === 0) {
      reach = reachOf(value, tolerance ?? NOISE * Math.abs(value))
      group++
    }
    numbers[order[k]] = group
  }
  return numbers
}

// Values of the objectives as integers, equal where the values are equal up to rounding: dominance
// is told by comparing these.
class Levels {
  constructor(F) {
    this.ranks = []
    this.exact = [] // whether no two values of a column are equal up to rounding only
    this.chained = false
    const rows = upTo(F[0].length)
    for (const values of F) {
      const order = argsort(values, rows)
      this.ranks.push(numbered(values, order, null, new Int32Array(rows.length)))
      let exact = true
      for (let k = 1; k < order.length; k++) {
        const before = values[order[k - 1]]
        const value = values[order[k]]
        if (value === before || value > reachOf(before, NOISE * Math.abs(before))) continue
        exact = false
        // Each close to the next, the last far from the first: where such a chain is cut depends on
        // which of its values are left, so that ranks of all rows say nothing certain of some.
        this.chained ||= this.ranks.at(-1)[order[k]] !== this.ranks.at(-1)[order[k - 1]]
      }
      this.exact.push(exact)
    }
  }

  // The ranks of some rows as Python finds them for these rows alone.
  of(F, rows) {
    return !this.chained ? this.ranks : F.map((values) =>
      numbered(values, argsort(values, rows), null, new Int32Array(values.length)))
  }
}

// Finds which of some rows dominates a row.
//
// Each column's order is cut into parts. Kept for each part as bits, one a row, is what lies in it
// or before it: what all columns have in common holds all that dominate a row of these parts, and a
// few more. So many rows are looked at at once that a search ends in microseconds, whether it finds
// something or nothing, for two columns or ten. Bits follow the sums of the ranks: what dominates
// stands before. The last that does is the most alike, and so the last to go when limits move.
class Dominators {
  constructor(ranks, rows) {
    const n = rows.length
    const sums = new Float64Array(ranks[0].length)
    for (const column of ranks) for (let k = 0; k < n; k++) sums[rows[k]] += column[rows[k]]
    Object.assign(this, {ranks, sums, order: argsort(sums, rows)})
    this.words = (n + 31) >>> 5
    this.place = new Int32Array(sums.length)
    for (let k = 0; k < n; k++) this.place[this.order[k]] = k
    this.parts = [] // by column and row
    this.below = [] // by column, the bits of each part in turn
    for (const column of ranks) {
      const starts = new Int32Array(sums.length + 1) // of each rank in the order
      for (let k = 0; k < n; k++) starts[column[rows[k]] + 1]++
      for (let rank = 0; rank < sums.length; rank++) starts[rank + 1] += starts[rank]
      const parts = new Uint8Array(sums.length)
      const bits = new Int32Array(PARTS * this.words)
      for (let k = 0; k < n; k++) {
        const i = rows[k]
        const place = this.place[i]
        parts[i] = (starts[column[i]] / n) * PARTS
        bits[parts[i] * this.words + (place >>> 5)] |= 1 << (place & 31)
      }
      for (let at = this.words; at < bits.length; at++) bits[at] |= bits[at - this.words]
      this.parts.push(parts)
      this.below.push(bits)
    }
  }

  // Rows as `of` takes them: bits, and by word the last one up to it that is not empty, or -1.
  among(rows) {
    const {place, words} = this
    const bits = new Int32Array(words)
    for (let k = 0; k < rows.length; k++) bits[place[rows[k]] >>> 5] |= 1 << (place[rows[k]] & 31)
    const filled = new Int32Array(words)
    for (let w = 0, last = -1; w < words; w++) filled[w] = last = bits[w] === 0 ? last : w
    return {bits, filled}
  }

  // One of the rows in `among` that dominates a row; -1 if there is none.
  of(i, {bits, filled}) {
    const {ranks, sums, order, place, parts, below, words} = this
    const last = filled[place[i] >>> 5]
    if (last < 0) return -1 // at once: of what was optimal, as long as no design comes back
    // The column in which fewest rows are below comes first: little is left for the others.
    const columns = parts.map((_, j) => j).sort((a, b) => parts[a][i] - parts[b][i])
    const sets = columns.map((j) => below[j])
    const starts = columns.map((j) => parts[j][i] * words)
    for (let w = last; w >= 0; w = w > 0 ? filled[w - 1] : -1) {
      let left = bits[w]
      for (let j = 0; j < sets.length && left !== 0; j++) left &= sets[j][starts[j] + w]
      while (left !== 0) {
        const bit = 31 - Math.clz32(left)
        const other = order[32 * w + bit]
        if (sums[other] < sums[i] && ranks.every((column) => column[other] <= column[i])) return other
        left ^= 1 << bit
      }
    }
    return -1
  }
}

// The rows that no row left dominates, in ascending order.
//
// A row that is Pareto optimal among all is so among fewer. Of each other row the file names one,
// itself optimal among all, that dominates it: as long as this witness is left, nothing is to be
// searched. From call to call few designs come and go: a dominator that was found is kept for the
// next call, and what was optimal in the last one is compared with designs that have come back only.
function frontOf(data, mask, rows) {
  const {witness, latest, levels} = data
  const {chained} = levels // what dominates what is then not that of all rows
  const isOptimal = new Uint8Array(data.total)
  const free = []
  for (let k = 0; k < rows.length; k++) {
    const i = rows[k]
    if (chained) free.push(i)
    else if (witness[i] < 0) isOptimal[i] = 1
    else if (!mask[witness[i]] && !mask[latest[i]]) free.push(i)
  }
  if (free.length) {
    // Without chains those of all rows, made once.
    const dominators = chained || data.dominators === null
      ? new Dominators(levels.of(data.F, rows), chained ? rows : upTo(data.n))
      : data.dominators
    if (!chained) data.dominators = dominators
    const {mask: before, pareto} = chained || data.last === null ? {} : data.last
    const all = dominators.among(rows)
    const added = before ? dominators.among(picked(rows, (i) => !before[i])) : all
    for (const i of free) {
      const by = dominators.of(i, pareto?.[i] ? added : all)
      if (by < 0) isOptimal[i] = 1
      else latest[i] = by
    }
  }
  return rowsOf(isOptimal)
}

// The objectives of some rows, those equal up to rounding made the least of them (`settled`).
function settled(data, rows) {
  return data.F.map((column, j) => {
    const result = new Float64Array(rows.length)
    for (let k = 0; k < rows.length; k++) result[k] = column[rows[k]]
    if (data.levels.exact[j]) return result
    let least = 0
    let reach = -Infinity
    argsort(result, upTo(rows.length)).forEach((place, k) => {
      const value = result[place]
      if (k === 0 || value > reach) {
        least = value
        reach = reachOf(value, NOISE * Math.abs(value))
      }
      result[place] = least
    })
    return result
  })
}

function leastOf(array) {
  let least = Infinity
  for (let k = 0; k < array.length; k++) if (array[k] < least) least = array[k]
  return least
}

function greatestOf(array) {
  let greatest = -Infinity
  for (let k = 0; k < array.length; k++) if (array[k] > greatest) greatest = array[k]
  return greatest
}

// What differences are divided by; infinite where a span is none (`unit_lengths`).
const lengthsOf = (low, high) => low.map((least, j) => {
  const span = high[j] - least
  return span > NOISE * Math.max(Math.abs(least), Math.abs(high[j])) ? span : Infinity
})

// ---------------------------------------------------------------------------- ranks of efficiency

const farIfNaN = (value) => (Number.isNaN(value) ? Infinity : value)

// The geometric criteria of rows in units in which no square over- or underflows: `measured` of
// pareto/_ranking.py, step by step.
class Frame {
  constructor(ideal, nadir, normalize) {
    Object.assign(this, {ideal, nadir})
    this.lengths = lengthsOf(ideal, nadir)
    this.scale = normalize ? this.lengths : this.lengths.map(() => 1)
    this.line = this.lengths.map((length, j) =>
      Number.isFinite(length) ? (nadir[j] - ideal[j]) / this.scale[j] : 0)
    const most = Math.max(...this.line) || 1
    const line = this.line.map((value) => value / most)
    const norm = Math.sqrt(line.reduce((sum, value) => sum + value * value, 0)) || 1
    this.direction = line.map((value) => value / norm)
  }

  // The greatest size of a value of a column.
  size(j) {
    return Math.max(Math.abs(this.ideal[j]), Math.abs(this.nadir[j]))
  }

  // Three arrays of `size`, filled for some rows of F, else NaN, and their units.
  measured(F, rows, size) {
    const {ideal, scale, direction: e} = this
    let line = this.line
    const longest = line.indexOf(Math.max(...line))
    let unit = line[longest]
    if (!unit) { // the ideal is the nadir
      F.forEach((column, j) => {
        for (const i of rows) {
          const d = Math.abs((column[i] - ideal[j]) / scale[j])
          if (Number.isFinite(d) && d > unit) unit = d
        }
      })
      unit ||= 1
    }
    const lift = unit < 1e-290 ? 2 ** 600 : 1
    line = line.map((value) => value * lift)
    unit *= lift
    const acrossUnit = Math.max(0, ...line.filter((_, j) => j !== longest)) || unit
    const perUnit = 1 / unit
    const perAcross = 1 / acrossUnit
    const mu = [0, 1, 2].map(() => new Float64Array(size).fill(NaN))
    const [mu1, mu2, mu3] = mu
    const m = F.length
    const d = new Float64Array(m)
    for (let k = 0; k < rows.length; k++) {
      const i = rows[k]
      for (let j = 0; j < m; j++) d[j] = ((F[j][i] - ideal[j]) / scale[j]) * lift
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
      mu1[i] = farIfNaN(Math.sqrt(square))
      mu2[i] = farIfNaN(Math.sqrt(squareAcross))
      mu3[i] = farIfNaN(onLine)
      if (mu1[i] < Infinity && mu2[i] < Infinity) continue
      // The squares, not the distance, may be too large for a float.
      mu1[i] = farIfNaN(Math.hypot(...d.map((part) => part * perUnit)))
      mu2[i] = farIfNaN(Math.hypot(...d.map((part, j) =>
        (part - share * line[j] - along * e[j]) * perAcross)))
    }
    return [mu, [unit / lift, acrossUnit / lift, unit / lift]]
  }

  // What rounding errors of the objectives do to the three criteria.
  noise(units) {
    const e2 = this.direction.map((value) => value * value)
    const across = e2.map((_, j) =>
      Math.sqrt(e2.reduce((sum, value, k) => (k === j ? sum : sum + value), 0)))
    const sizes = this.lengths.map((length, j) =>
      Number.isFinite(length) ? this.size(j) / this.scale[j] : 0)
    return [e2.map(() => 1), across, this.direction].map((parts, k) =>
      LAST_PLACES * Math.hypot(...parts.map((part, j) => (part * sizes[j]) / units[k])))
  }
}

// Mark the points (a, b) that no other dominates; of equal ones those of the least `other`. `order`
// are the points by a.
function nondominatedPair(order, a, b, other) {
  const mask = new Uint8Array(a.length)
  let low = Infinity
  for (let k = 0; k < order.length; k++) {
    let least = b[order[k]]
    if (least >= low) continue // only what is better than all before
    let end = k + 1
    for (; end < order.length && a[order[end]] === a[order[k]]; end++) {
      least = Math.min(least, b[order[end]])
    }
    const group = order.subarray(k, end).filter((i) => b[i] === least)
    const first = group.reduce((one, i) => Math.min(one, other[i]), Infinity)
    for (const i of group) if (other[i] === first) mask[i] = 1
    low = least
    k = end - 1
  }
  return mask
}

// The ranking of the rows left: `rank_of_efficiency` of pareto/_ranking.py.
//   mask, rows, count     what was ranked, without prototypes
//   front, byMu1          the Pareto-optimal rows, and these with the nearest to the ideal first
//   pareto, rank          by row; the rank of a prototype and of a row not left is -1
//   mu1, mu2, mu3         by row, of prototypes too
//   ideal, nadir          in the user's own sense; [] if no row is left
//   best, isBest          the rows of the Salukvadze optimum; the same by row
function ranked(data, mask) {
  const {n, total, F} = data
  const rows = rowsOf(mask, n)
  const pareto = new Uint8Array(total)
  const rank = new Int8Array(total).fill(-1)
  const empty = () => new Float64Array(total).fill(NaN)
  if (rows.length === 0) {
    return {mask, rows, count: 0, front: rows, byMu1: rows, pareto, rank, mu1: empty(),
      mu2: empty(), mu3: empty(), ideal: [], nadir: [], best: [],
      isBest: new Uint8Array(total), frame: null, V: []}
  }
  const front = frontOf(data, mask, rows)
  const V = settled(data, front)
  const frame = new Frame(V.map(leastOf), V.map(greatestOf), data.normalize)
  const all = new Int32Array(rows.length + total - n)
  all.set(rows)
  for (let i = n; i < total; i++) all[rows.length + i - n] = i
  // Settled where a criterion has values that are equal up to rounding only.
  const measuredF = F.map((column, j) => {
    if (data.levels.exact[j]) return column
    const copy = column.slice()
    front.forEach((i, k) => { copy[i] = V[j][k] })
    return copy
  })
  const [mu, units] = frame.measured(measuredF, all, total)
  const noise = frame.noise(units)
  const orders = mu.map((column) => argsort(column, front))
  const levels = mu.map((column, k) =>
    numbered(column, orders[k], noise[k], new Int32Array(total)))
  const p12 = nondominatedPair(orders[0], levels[0], levels[1], levels[2])
  const p13 = nondominatedPair(orders[0], levels[0], levels[2], levels[1])
  const p23 = nondominatedPair(orders[1], levels[1], levels[2], levels[0])
  for (let k = 0; k < rows.length; k++) rank[rows[k]] = 0
  for (let k = 0; k < front.length; k++) {
    const i = front[k]
    pareto[i] = 1
    // P12 and P13 lie inside P23 but for the tolerance.
    rank[i] = 3 * (p23[i] | p12[i] | p13[i]) + 2 * p13[i] + p12[i]
  }
  const isBest = new Uint8Array(total)
  let ties = 0
  while (ties < front.length && levels[0][orders[0][ties]] === 0) isBest[orders[0][ties++]] = 1
  const best = [...orders[0].slice(0, ties).sort()]
  mu.forEach((column, k) => {
    const unit = units[k]
    for (let at = 0; at < all.length; at++) column[all[at]] *= unit
  })
  const turned = (point) => point.map((value, j) =>
    (data.criteria[j].maximize ? -value : value) + 0)
  data.last = {mask: mask.slice(), pareto} // the caller's mask may change
  return {mask, rows, count: rows.length, front, byMu1: orders[0], pareto, rank, mu1: mu[0],
    mu2: mu[1], mu3: mu[2], ideal: turned(frame.ideal), nadir: turned(frame.nadir), best, isBest,
    frame, V}
}

// ------------------------------------------------------------------------------------------ limits

// The least and the greatest value that a limit keeps: none that is missing or infinite.
const endsOf = (low, high) => [low ?? -Number.MAX_VALUE, high ?? Number.MAX_VALUE]

// By how much a limit is moved to show what it keeps out: a twentieth of the range of its column.
function relaxed(column, value, towards) {
  const [low, high] = column.range
  if (!(low < high)) return null
  if (column.log && value > 0) return value * (high / low) ** (0.05 * towards)
  return value + 0.05 * towards * (high - low)
}

const keptMasks = new WeakMap() // of lists of designs that are kept, which may be long
function keptMask(data, kept) {
  if (!keptMasks.has(kept)) {
    const mask = new Uint8Array(data.total)
    for (const id of kept) if (data.rowOf.has(id)) mask[data.rowOf.get(id)] = 1
    keptMasks.set(kept, mask)
  }
  return keptMasks.get(kept)
}

// The designs within all limits, and what each limit rejects. A value that is missing keeps none.
//   mask, count    prototypes are always in the mask and never counted
//   rejects, only  by name of the column: designs that a limit rejects; that nothing else rejects
//   relax          by name: {low, high}, each null or {value, back}: a limit a little farther out
//                  and how many designs it would bring back
function left(data, state) {
  const {n, total} = data
  const conditions = [] // name, which rows are rejected
  const add = (name, rejected) => conditions.push({name, rejected})
  for (const [name, [low, high]] of Object.entries(state.limits)) {
    const {values} = data.by.get(name)
    const rejected = new Uint8Array(n)
    const [least, most] = endsOf(low, high)
    for (let i = 0; i < n; i++) rejected[i] = values[i] >= least && values[i] <= most ? 0 : 1
    add(name, rejected)
  }
  for (const [name, allowed] of Object.entries(state.categories)) {
    const {values, texts} = data.by.get(name)
    const ticked = new Set(allowed)
    const out = Uint8Array.from(texts, (text) => (ticked.has(text) ? 0 : 1))
    const rejected = new Uint8Array(n)
    for (let i = 0; i < n; i++) rejected[i] = out[values[i]]
    add(name, rejected)
  }
  const times = new Uint32Array(n) // by how many conditions a design is rejected
  for (const {rejected} of conditions) for (let i = 0; i < n; i++) times[i] += rejected[i]
  if (state.kept !== null) {
    const kept = keptMask(data, state.kept)
    for (let i = 0; i < n; i++) if (!kept[i]) times[i] += 2 // no relaxed limit brings it back
  }
  const mask = new Uint8Array(total).fill(1)
  let count = 0
  for (let i = 0; i < n; i++) count += mask[i] = times[i] ? 0 : 1
  const [rejects, only, relax] = [new Map(), new Map(), new Map()]
  for (const {name, rejected} of conditions) {
    let [all, alone] = [0, 0]
    for (let i = 0; i < n; i++) {
      all += rejected[i]
      alone += rejected[i] & (times[i] === 1)
    }
    rejects.set(name, all)
    only.set(name, alone)
    if (!Object.hasOwn(state.limits, name)) continue
    const column = data.by.get(name)
    const [low, high] = state.limits[name]
    const back = (value, lower, upper) => {
      if (value === null) return null
      const [least, most] = endsOf(lower, upper)
      let number = 0
      for (let i = 0; i < n; i++) {
        if (times[i] === 1 && rejected[i] && column.values[i] >= least && column.values[i] <= most) number++
      }
      return {value, back: number}
    }
    const lower = low === null ? null : relaxed(column, low, -1)
    const upper = high === null ? null : relaxed(column, high, 1)
    relax.set(name, {low: back(lower, lower, high), high: back(upper, low, upper)})
  }
  return {mask, count, rejects, only, relax}
}

// ------------------------------------------------------------------------------------- the orders

// All rows by a column, sorted once.
const sortedOnce = new WeakMap()
function byColumn(data, column) {
  if (!sortedOnce.has(column)) {
    sortedOnce.set(column, argsort(column.values, upTo(data.n)))
  }
  return sortedOnce.get(column)
}

// The rows shown, prototypes first, then the best design first; dominated designs come last but
// where they are sorted by a column.
function order(data, ranking, state) {
  const {by, name, down} = state.order
  const {pareto, rank, mask, isBest} = ranking
  const hasRank = RANKS.map((r) => state.ranks === null || state.ranks.includes(r))
  const shows = (i) => mask[i] &&
    (pareto[i] ? hasRank[rank[i]] || (hasRank[6] && isBest[i]) : state.dominated)
  const joined = (...lists) => {
    const prototypes = data.total - data.n
    const result = new Int32Array(lists.reduce((sum, list) => sum + list.length, prototypes))
    for (let k = 0; k < prototypes; k++) result[k] = data.n + k
    let at = prototypes
    for (const list of lists) {
      result.set(list, at)
      at += list.length
    }
    return result
  }
  const turned = (list) => (down ? list.slice().reverse() : list)
  if (by === "column") {
    const column = data.by.get(name)
    const array = values(data, ranking, column)
    const sorted = column.role === "geometric" ? argsort(array, picked(ranking.rows, shows))
      : picked(byColumn(data, column), shows)
    // Missing values stay last in either direction.
    const known = picked(sorted, (i) => !Number.isNaN(array[i]))
    return joined(turned(known), sorted.subarray(known.length))
  }
  const dominated = state.dominated ? picked(ranking.rows, (i) => !pareto[i]) : new Int32Array(0)
  if (by === "preference") {
    const {value, sum, best} = preference(data, ranking, state.preference)
    const chosen = new Set(best) // first, as rounding would order those that tie
    const others = picked(ranking.front, (i) => !chosen.has(i) && shows(i))
    const first = joined(best.filter(shows), argsort(value, argsort(sum, others)))
    return joined(turned(first.subarray(data.total - data.n)), turned(argsort(value, dominated)))
  }
  const nearest = picked(ranking.byMu1, shows)
  const next = new Int32Array(8) // by 6 - rank, where its next row goes
  for (let k = 0; k < nearest.length; k++) next[7 - rank[nearest[k]]]++
  for (let r = 1; r < 7; r++) next[r] += next[r - 1]
  const best = new Int32Array(nearest.length)
  for (let k = 0; k < nearest.length; k++) best[next[6 - rank[nearest[k]]]++] = nearest[k]
  return joined(turned(best), turned(argsort(ranking.mu1, dominated)))
}

// The achievement function of every row left, max w (f - r) / range, the least of which is chosen,
// and the sum of its terms, which decides ties: pareto/_compromise.py. Without an aspiration a
// criterion is measured from its best value; weights are 1 unless given.
function preference(data, ranking, {weights, aspiration}) {
  const {F, criteria, total, n} = data
  const value = new Float64Array(total).fill(NaN)
  const sum = new Float64Array(total).fill(NaN)
  if (ranking.count === 0) return {value, sum, best: []}
  const {frame, front, V} = ranking
  const given = criteria.map(({name}) => (Object.hasOwn(weights, name) ? weights[name] : 1))
  const most = Math.max(...given)
  const ratios = given.map((weight) => (most > 0 ? weight / most : 1))
  const all = ratios.reduce((a, b) => a + b, 0)
  const w = ratios.map((ratio) => ratio / all)
  const point = criteria.map(({name, maximize}, j) => {
    if (!Object.hasOwn(aspiration, name)) return frame.ideal[j]
    return maximize ? -aspiration[name] : aspiration[name]
  })
  let unit = 0 // so that no sum of terms overflows
  V.forEach((column, j) => {
    for (const end of [leastOf(column), greatestOf(column)]) {
      unit = Math.max(unit, Math.abs((end - point[j]) / frame.scale[j]))
    }
  })
  unit ||= 1
  const measure = (columns, k, row) => {
    let [most, total] = [-Infinity, 0]
    for (let j = 0; j < columns.length; j++) {
      const term = w[j] * ((columns[j][k] - point[j]) / frame.scale[j] / unit)
      if (term > most) most = term
      total += term
    }
    value[row] = most
    sum[row] = total
  }
  for (const i of ranking.rows) measure(F, i, i)
  for (let i = n; i < total; i++) measure(F, i, i)
  for (let k = 0; k < front.length; k++) measure(V, k, front[k])
  const noise = V.map((column, j) => {
    const scaled = Number.isFinite(frame.lengths[j]) ? frame.size(j) / frame.scale[j] : 0
    return LAST_PLACES * w[j] * (Math.max(scaled, Math.abs(point[j] / frame.scale[j])) / unit)
  })
  const nearest = (list, key, tolerance) => {
    const reach = reachOf(leastOf(Float64Array.from(list, (i) => key[i])), tolerance)
    return list.filter((i) => key[i] <= reach)
  }
  const first = nearest(front, value, Math.max(...noise))
  const best = [...nearest(first, sum, noise.reduce((a, b) => a + b, 0))]
  for (const column of [value, sum]) for (let i = 0; i < total; i++) column[i] *= unit
  return {value, sum, best}
}

// ----------------------------------------------------------------------------------------- wording

// A name that the user gave stays as it is.
const capital = (text) => text.replace(/^(design|row|test point) /, (ours) =>
  ours[0].toUpperCase() + ours.slice(1))
const listed = (names) =>
  names.length > 1 ? `${names.slice(0, -1).join(", ")} and ${names.at(-1)}` : names.join("")
const counted = (n, one, many = `${one}s`) => `${n} ${n === 1 ? one : many}`

// The digits of a number as Python rounds them, an exact half to the even digit: 62.5 -> 62.
function rounded(value, digits) {
  const up = value.toExponential(digits - 1) // of an exact half the larger one
  const [mantissa, exponent] = Math.abs(value).toExponential(60).split("e")
  const all = mantissa.replace(".", "")
  const half = all[digits] === "5" && /^0*$/.test(all.slice(digits + 1))
  if (!half || Number(all[digits - 1]) % 2) return up
  const kept = all.slice(0, digits)
  return `${value < 0 ? "-" : ""}${kept[0]}${digits > 1 ? "." : ""}${kept.slice(1)}e${exponent}`
}

// A number with a few digits as Python's format "g" writes it, large ones without an exponent
// (`number` of pareto/_sentences.py).
function short(value, digits) {
  if (value === 0 || !Number.isFinite(value)) return String(value).replace("Infinity", "inf")
  const [mantissa, power] = rounded(value, digits).split("e")
  const exponent = Number(power)
  const bare = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text)
  if (exponent >= digits && Math.abs(value) < 1e7) return String(Number(`${mantissa}e${power}`))
  if (exponent < -4 || exponent >= digits) {
    const size = String(Math.abs(exponent)).padStart(2, "0")
    return `${bare(mantissa)}e${exponent < 0 ? "-" : "+"}${size}`
  }
  return bare(Number(`${mantissa}e${power}`).toFixed(Math.max(0, digits - 1 - exponent)))
}

// A share as a sentence tells it: two digits, none behind the point above 10 (`percent`).
function percent(share) {
  const hundreds = 100 * share
  if (hundreds > 0 && hundreds < 0.01) return "less than 0.01 %"
  if (!Number.isFinite(hundreds)) return `${String(hundreds).replace("Infinity", "inf")} %`
  if (hundreds < 9.95) return `${short(hundreds, 2)} %`
  const digits = Math.floor(Math.log10(hundreds)) + 1
  return `${Number(rounded(hundreds, hundreds < 10 ? 1 : digits)).toFixed(0)} %`
}

function amount(value, unit, share, first) {
  const text = short(value, 4) + (unit ? ` ${unit}` : "")
  if (Number.isNaN(share)) return text
  return `${text} (${percent(share)}${first ? " of its range" : ""})`
}

// A number with the digits that tell designs of its column apart; a text is itself.
function written(column, value) {
  if (column.texts) return column.texts[value] || "–"
  if (value === null || Number.isNaN(value)) return "–"
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "-∞"
  const [kind, digits] = column.notation
  // Values beyond the range of the column, penalties perhaps, have no place in its notation.
  if (kind === "fixed" && Math.abs(value) < 1e7) return value.toFixed(digits)
  return value.toExponential(kind === "fixed" ? 3 : digits)
}

// ------------------------------------------------------------------------------------- explanations

// Differences in units of the ranges; NaN for one where the range is 0.
const shareOf = (difference, length) =>
  length === Infinity && difference !== 0 ? NaN : difference / length + 0

// Where a design is better than another and where worse, in words (`DesignComparison.difference`).
function difference(data, gains, shares) {
  const places = gains.map((_, j) => j)
  const size = (j) => (Number.isNaN(shares[j]) ? -1 : Math.abs(shares[j]))
  places.sort((a, b) => size(b) - size(a) || a - b)
  const parts = []
  let first = true
  for (const [word, there] of [["better", (g) => g > 0], ["worse", (g) => g < 0]]) {
    const told = []
    for (const j of places.filter((j) => there(gains[j]))) {
      const {name, unit} = data.criteria[j]
      told.push(`${name} by ${amount(Math.abs(gains[j]), unit, Math.abs(shares[j]), first)}`)
      first = false
    }
    if (told.length) parts.push(`${word} in ${told.join(", ")}`)
  }
  return parts.join("; ") || "equal in all criteria"
}

// The objectives of the front and of further rows, those equal up to rounding made the same.
function withRows(data, ranking, rows) {
  const {front, V} = ranking
  if (data.levels.exact.every(Boolean)) { // as is usual: nothing to be copied
    return {V, own: data.F.map((column) => rows.map((row) => column[row]))}
  }
  const all = new Int32Array(front.length + rows.length)
  all.set(front)
  all.set(rows, front.length)
  const together = settled(data, all)
  return {
    V: together.map((column) => column.subarray(0, front.length)),
    own: together.map((column) => [...column.subarray(front.length)]),
  }
}

// Gains of rows against the first of them and shares of the ranges, a list each (`compared`).
function gainsOf(data, ranking, rows) {
  const {own} = withRows(data, ranking, rows)
  const gains = rows.map((_, k) => own.map((column) => column[0] - column[k] + 0))
  const shares = gains.map((list) => list.map((gain, j) => shareOf(gain, ranking.frame.lengths[j])))
  return {gains, shares}
}

// The rows to compare, the base first: what the reader has made the base, else the existing design,
// else what is pinned first, else the optimum of all designs. Beside it stand the best, the chosen
// one and what is pinned; if that is one design alone, the next by rank, so that there is always
// something to compare with. Each with its part: `{row, roles}`.
function compared(data, ranking, state) {
  if (ranking.count === 0) return []
  const row = (id) => data.rowOf.get(id) ?? -1
  const pins = state.pins.map(row)
  const best = ranking.best[0]
  const whole = data.whole.isBest[best] ? best : data.whole.best[0]
  const existing = data.total > data.n ? data.n : -1
  const chosen = row(state.chosen)
  const base = [row(state.base), existing, pins[0] ?? -1, whole].find((i) => i >= 0)
  const rows = new Set([base, existing, best, chosen, ...pins].filter((i) => i >= 0))
  let next = -1
  if (rows.size === 1) {
    for (const i of ranking.byMu1) {
      if (i !== base && (next < 0 || ranking.rank[i] > ranking.rank[next])) next = i
    }
    if (next >= 0) rows.add(next)
  }
  const named = [[base, "base"], [best, "best"], [chosen, "chosen"], [next, "next by rank"],
    [best === whole ? -1 : whole, "best without limits"]]
  return [...rows].map((i) => ({
    row: i, roles: named.filter(([one]) => one === i).map(([, role]) => role),
  }))
}

// What rows give and take against one of them. `better` is 1, 0 or -1; `percent` is of the size of
// the other's value, `share` of the range of the Pareto set, above 0 where it is better.
function compare(data, ranking, rows, base) {
  if (ranking.count === 0) return {criteria: [], sentences: []}
  const {gains, shares} = gainsOf(data, ranking, [base, ...rows])
  const criteria = data.criteria.map(({name, unit, maximize, values}, j) => {
    const differences = rows.map((_, k) => (maximize ? 1 : -1) * gains[k + 1][j] + 0)
    const size = Math.abs(values[base])
    return {
      name,
      unit,
      values: rows.map((row) => values[row]),
      differences,
      percent: differences.map((d) => (d === 0 ? 0 : size === 0 ? NaN : (100 * d) / size)),
      share: rows.map((_, k) => shares[k + 1][j]),
      better: rows.map((_, k) => Math.sign(gains[k + 1][j])),
    }
  })
  const sentences = rows.map((row, k) =>
    `${capital(called(data, row))} against ${called(data, base)}: ` +
    `${difference(data, gains[k + 1], shares[k + 1])}.`)
  return {criteria, sentences}
}

// Why a design: its distances from the best, and what the nearest design that is better in a
// criterion costs in the others: pareto/_explanation.py. Any row, also dominated or a prototype.
function explain(data, ranking, row) {
  if (ranking.count === 0) return null
  const {front, frame, pareto} = ranking
  const {lengths} = frame
  const {criteria} = data
  const m = criteria.length
  const n = front.length
  const {V, own: columns} = withRows(data, ranking, [row])
  const own = columns.map(([value]) => value)
  const behind = own.map((value, j) => value - leastOf(V[j]))
  const shares = behind.map((value, j) => shareOf(value, lengths[j]))
  const distance = new Float64Array(n)
  V.forEach((column, j) => {
    const [value, length] = [own[j], lengths[j]]
    for (let k = 0; k < n; k++) {
      const d = (column[k] - value) / length
      distance[k] += d * d
    }
  })
  for (let k = 0; k < n; k++) distance[k] = farIfNaN(Math.sqrt(distance[k]))
  // Of the nearest designs that gain `step` in a column, if several tie, the least there; or -1.
  const nearest = (column, value, step) => {
    let reach = Infinity
    const near = [] // so far
    for (let k = 0; k < n; k++) {
      const gain = value - column[k]
      if (!(distance[k] <= reach && gain > 0 && gain >= step)) continue
      near.push(k)
      reach = Math.min(reach, distance[k] * (1 + TIE))
    }
    const tied = near.filter((k) => distance[k] <= reach)
    return tied.length ? tied.reduce((a, k) => (column[k] < column[a] ? k : a)) : -1
  }
  const neighbours = V.map((column, j) => {
    let near = nearest(column, own[j], STEP * lengths[j])
    if (near < 0) near = nearest(column, own[j], 0)
    return near < 0 ? -1 : front[near]
  })
  let dominatedBy = -1
  if (!pareto[row]) {
    // The least excess, not none: a chain of close values may be settled otherwise here. Of those
    // that share it the nearest is told.
    const excess = new Float64Array(n)
    for (let k = 0; k < n; k++) {
      for (let j = 0; j < m; j++) {
        excess[k] = Math.max(excess[k], (V[j][k] - own[j]) / lengths[j] || 0)
      }
    }
    const least = leastOf(excess)
    const accepted = excess.map((value) => (value === least ? 0 : 1))
    dominatedBy = front[nearest(accepted, 0.5, 0)]
  }
  const sizes = shares.map((share) => (Number.isNaN(share) ? Infinity : share))
  const ordered = shares.map((_, j) => j).sort((a, b) => sizes[b] - sizes[a] || a - b)
  const most = Math.max(0, ...shares.filter((share) => !Number.isNaN(share)))
  const weakest = most === 0 ? []
    : criteria.filter((_, j) => shares[j] >= most * (1 - TIE)).map(({name}) => name)
  // A neighbour towards several criteria is told once.
  const steps = []
  for (const j of ordered.filter((j) => neighbours[j] >= 0)) {
    const told = steps.find((step) => step.row === neighbours[j])
    if (told) told.names.push(criteria[j].name)
    else steps.push({names: [criteria[j].name], row: neighbours[j]})
  }
  const against = gainsOf(data, ranking, [row, ...steps.map((step) => step.row)])
  steps.forEach((step, k) => {
    const [gains, parts] = [against.gains[k + 1], against.shares[k + 1]]
    step.label = called(data, step.row)
    step.text = difference(data, gains, parts)
    step.gains = criteria.map(({name, unit}, j) =>
      ({name, unit, gain: gains[j], share: parts[j]}))
  })
  return {
    row,
    label: called(data, row),
    criteria: criteria.map(({name, unit, values}, j) => ({
      name, unit, value: values[row], best: ranking.ideal[j], worst: ranking.nadir[j],
      away: behind[j], share: shares[j],
    })),
    weakest,
    steps,
    dominatedBy,
    sentences: [
      standing(data, ranking, row, dominatedBy),
      distances(data, ranking, ordered, behind, shares, weakest),
      ...steps.map((step) => `Towards ${listed(step.names)}: ${step.label} is ${step.text}.`),
    ],
  }
}

// What a design is among the others, as a sentence.
function standing(data, ranking, row, dominatedBy) {
  const {front, best, isBest, rank, mask} = ranking
  const name = capital(called(data, row))
  const all = counted(front.length, "Pareto-optimal design")
  if (row >= data.n) return `${name} is not among the designs that are ranked.`
  if (!mask[row]) return `${name} is beyond the limits.`
  if (dominatedBy >= 0) {
    const {gains, shares} = gainsOf(data, ranking, [row, dominatedBy])
    const by = difference(data, gains[1], shares[1])
    return `${name} is dominated: ${called(data, dominatedBy)} is ${by}.`
  }
  if (front.length === 1) return `${name} is the only Pareto-optimal design.`
  if (isBest[row]) {
    if (best.length === 1) {
      return `${name} is the Salukvadze optimum: the nearest of ${all} to the ideal point.`
    }
    return `${name} is a Salukvadze optimum: one of ${best.length} of ${all} that are equally ` +
      "near to the ideal point."
  }
  return `${name} is one of ${all}, of rank of efficiency ${rank[row]}.`
}

// How far a design is from the best of each criterion, as a sentence.
function distances(data, {frame}, ordered, behind, shares, weakest) {
  const {criteria} = data
  const there = ordered.filter((j) => behind[j] > 0)
  if (!there.length) return "It is the best in every criterion."
  const told = there.map((j, k) =>
    `${criteria[j].name} by ${amount(behind[j], criteria[j].unit, shares[j], k === 0)}`)
  const parts = [`Behind the best in ${told.join(", ")}`]
  if (told.length > 1 && weakest.length) parts.push(`weakest in ${listed(weakest)}`)
  for (const [what, constant] of [["the best", false], ["the same as all", true]]) {
    const names = criteria.filter((_, j) =>
      behind[j] === 0 && (frame.lengths[j] === Infinity) === constant)
    if (names.length) parts.push(`${what} in ${listed(names.map(({name}) => name))}`)
  }
  return `${parts.join("; ")}.`
}

// The best compromise under the limits, why, and what is bad about it; null if nothing is left.
function verdict(data, ranking) {
  if (ranking.count === 0) return null
  const told = explain(data, ranking, ranking.best[0])
  const worst = told.criteria.reduce((a, b) => (b.share > a.share ? b : a))
  const bad = worst.share > BAD && ranking.front.length > 1
  const first = data.whole.best[0]
  const differ = !data.whole.isBest[told.row]
  const sentence = differ &&
    `Without limits it would be ${called(data, first)}. ` +
    compare(data, data.whole, [told.row], first).sentences[0]
  return {
    ...told,
    bad,
    warning: bad
      ? `In ${listed(told.weakest)} it is ${percent(worst.share)} of the range away from the best.`
      : "",
    ties: ranking.best,
    whole: differ ? {row: first, label: called(data, first), sentence} : null,
  }
}

// ---------------------------------------------------------------------------------------- cautions

// What speaks against relying on the optimum, in sentences: pareto/_cautions.py, whose thresholds
// and reasons hold here. Up to two rankings for each criterion, so not for every step of a slider.
const [NEAR, ELSEWHERE, EDGE, OUTWEIGHED, OUTLIER, FEW] = [0.01, 0.1, 0.01, 10, 2, 20]
const NEARLY = ", to within 1 % of the range"

function cautions(data, ranking) {
  const {front, frame, V, best, isBest, mu1, rank} = ranking
  if (ranking.count === 0) return []
  const {criteria, normalize} = data
  const n = front.length
  const names = (places) => listed(places.map((j) => criteria[j].name))
  const low = V.map(leastOf)
  const {lengths} = frame
  const D = V.map((column, j) => column.map((value) => (value - low[j]) / lengths[j]))
  const m = D.length
  const varying = D.map((_, j) => j).filter((j) => D[j].some((d) => d !== 0))
  if (!varying.length) {
    if (ranking.count === 1 || m === 1) return []
    return [n > 1 ? `All ${n} Pareto-optimal designs have the same values.`
      : "Only one design is Pareto optimal: the criteria do not conflict."]
  }
  const found = []
  const constant = D.map((_, j) => j).filter((j) => !varying.includes(j))
  if (constant.length) {
    found.push(`Equal for all Pareto-optimal designs, and without weight: ${names(constant)}.`)
  }
  if (n >= 3) {
    const groups = []
    for (let rest = varying; rest.length;) {
      const first = rest[0]
      const same = rest.filter((j) => D[j].every((d, k) => Math.abs(d - D[first][k]) <= EDGE))
      if (same.length > 1) groups.push(names(same))
      rest = rest.filter((j) => !same.includes(j))
    }
    if (groups.length) {
      found.push("Criteria that agree to within 1 % of their ranges, and so count more than once: " +
        `${groups.join("; ")}.`)
    }
  }
  const spans = V.map((column, j) => greatestOf(column) - low[j])
  const most = varying.reduce((a, j) => (spans[j] > spans[a] ? j : a))
  const least = varying.reduce((a, j) => (spans[j] < spans[a] ? j : a))
  if (!normalize && spans[most] >= OUTWEIGHED * spans[least]) {
    found.push(`Without normalising, ${names([most])} with a range of ${short(spans[most], 3)} ` +
      `outweighs ${names([least])} with one of ${short(spans[least], 3)}.`)
  }

  const mu = Float64Array.from(front, (i) => mu1[i])
  const places = upTo(n)
  const optimum = front.indexOf(best[0])
  const limit = mu[optimum] * (1 + NEAR)
  const near = places.filter((k) => mu[k] <= limit)
  const spread = Math.max(...D.map((column) => {
    const shares = Float64Array.from(near, (k) => column[k])
    return greatestOf(shares) - leastOf(shares)
  }))
  const equidistant = near.length >= 3 && 2 * near.length > n && spread > 0.5
  // By what share of a range a design differs most from the optimum, and in what.
  const apart = (k) => {
    const shares = D.map((column) => Math.abs(column[k] - column[optimum]))
    const share = Math.max(...shares)
    return [share, shares.indexOf(share)]
  }
  const name = (k) => called(data, front[k])
  if (equidistant) {
    found.push(`${near.length} of ${n} Pareto-optimal designs are within 1 % of the least ` +
      "distance to the ideal point, as on a sphere around it: a preference must choose.")
  } else {
    const different = places.filter((k) => isBest[front[k]] && apart(k)[0] > EDGE)
    if (different.length) {
      const more = different.length > 1 ? ` and ${different.length - 1} more` : ""
      found.push(`${capital(name(optimum))} is as near to the ideal point as ` +
        `${name(different[0])}${more}.`)
    }
    const others = near.filter((k) => !isBest[front[k]] && apart(k)[0] > ELSEWHERE)
    if (others.length) {
      const other = others.reduce((a, k) => (mu[k] < mu[a] ? k : a))
      const more = others.length > 1 ? `, one of ${others.length} such designs,` : ""
      const [share, j] = apart(other)
      const farther = percent(mu[other] / mu[optimum] - 1)
      const only = farther.startsWith("less") ? "" : "only "
      found.push(`${capital(name(other))}${more} is ${only}${farther} farther from the ideal ` +
        `point, and differs by ${percent(share)} of the range in ${names([j])}.`)
    }
    const worst = D.map((_, j) => j).filter((j) => D[j][optimum] >= 1 - EDGE)
    if (worst.length && n >= 3) {
      const nearly = worst.every((j) => D[j][optimum] === 1) ? "" : NEARLY
      const text = `The optimum is the worst in ${names(worst)}${nearly}: `
      found.push(text + (!normalize ? "it is no compromise." : "the set bulges away from the " +
        "ideal point, so that no compromise is nearer to it than the extreme designs."))
    }
    const edge = varying.filter((j) => D[j][optimum] <= EDGE)
    if (edge.length && n >= 3) {
      const nearly = edge.some((j) => D[j][optimum] !== 0) ? NEARLY : ""
      found.push(`The optimum is the best in ${names(edge)}${nearly}: it lies at an edge of the set.`)
    }
    const hanging = hangingOn(data, ranking, D, varying)
    if (hanging) found.push(hanging)
  }
  const efficient = front.filter((i) => rank[i] > 0).length
  if (n >= FEW && 2 * efficient > n) {
    found.push(`${efficient} of ${n} Pareto-optimal designs have a rank: ranks select little.`)
  }
  return found
}

// On which single extreme design the optimum hangs most, as a sentence; "" if on none.
function hangingOn(data, ranking, D, varying) {
  const {front, best, isBest, mask, V} = ranking
  const {criteria} = data
  const roles = new Map()
  for (const j of varying) {
    for (const [role, share] of [["best", 0], ["worst", 1]]) {
      const at = []
      for (let k = 0; k < front.length && at.length < 2; k++) if (D[j][k] === share) at.push(k)
      if (at.length === 1 && !isBest[front[at[0]]] && !roles.has(at[0])) {
        roles.set(at[0], `the ${role} in ${criteria[j].name}`)
      }
    }
  }
  let [moved, told] = [ELSEWHERE, ""]
  const old = best.map((row) => front.indexOf(row))
  for (const [k, role] of roles) {
    const without = mask.slice()
    without[front[k]] = 0
    const other = nearestOf(data, without)
    const found = other.best
    if (found.some((row) => isBest[row])) continue
    const {lengths} = other
    let closest = null // of the pairs of a new optimum and an old one
    for (const row of found) {
      const at = other.front.indexOf(row)
      for (const b of old) {
        const steps = other.V.map((column, j) => Math.abs(column[at] - V[j][b]) / lengths[j])
        const size = Math.max(...steps)
        if (!closest || size < closest.size) closest = {row, size, j: steps.indexOf(size)}
      }
    }
    if (!(closest.size > moved)) continue
    moved = closest.size
    const there = `${called(data, closest.row)}, which differs by ${percent(closest.size)} of the ` +
      `range in ${criteria[closest.j].name}`
    const stretched = V.map((column, j) =>
      Number.isFinite(lengths[j]) ? (greatestOf(column) - leastOf(column)) / lengths[j] : 0)
    const most = Math.max(...stretched)
    const who = called(data, front[k])
    told = most >= OUTLIER
      ? `${capital(who)} alone stretches the range of ${criteria[stretched.indexOf(most)].name} ` +
        `${short(most, 3)} times; without it the optimum would be ${there}.`
      : `Without ${who}, ${role}, the optimum would be ${there}.`
  }
  return told
}

// Criteria of which Pareto-optimal designs lie far beyond all others, as penalties do, and stretch the
// range by which all are ranked: how many, and the limits that would leave them out.
function stretched(data, ranking) {
  return data.criteria.filter(({clipped}) => clipped > 0).map((column) => {
    const [low, high] = column.range
    const beyond = ranking.front.filter((i) => column.values[i] < low || column.values[i] > high)
    const worst = beyond.reduce((a, i) => {
      return Math.abs(column.values[i]) > Math.abs(a) ? column.values[i] : a
    }, 0)
    const ends = [beyond.some((i) => column.values[i] < low) ? low : null,
      beyond.some((i) => column.values[i] > high) ? high : null]
    return {column, count: beyond.length, worst, ends}
  }).filter(({count}) => count > 0)
}

// The front of some rows, and those of it within rounding of the least distance to the ideal point:
// what a ranking would say of this alone, in a tenth of its time.
function nearestOf(data, mask) {
  const front = frontOf(data, mask, rowsOf(mask, data.n))
  const V = settled(data, front)
  const frame = new Frame(V.map(leastOf), V.map(greatestOf), data.normalize)
  const [[mu1]] = frame.measured(V, upTo(front.length), front.length)
  const limit = leastOf(mu1) * (1 + TIE)
  return {front, V, lengths: frame.lengths, best: front.filter((_, k) => mu1[k] <= limit)}
}

// ------------------------------------------------------------------------------------ typed numbers

// A number as a reader typed it: {value}, which is null for nothing, or {wrong}, what to type instead.
// Points and commas are read by the rules of table/_cells.py, and where these leave two readings of
// "1.250" the page's own, with a decimal point, if only that one is within the column's range.
function typed(text, column = null) {
  const spaced = text.trim().replace(/[−–]/g, "-")
  if (spaced === "") return {value: null}
  const plain = spaced.replace(/(?<=\d)[ '’\u00a0\u2009\u202f](?=\d{3}(?!\d))/g, "")
  const [, sign, body, power = ""] = /^([+-]?)([\d.,]+)(e[+-]?\d+)?$/i.exec(plain) ?? []
  const groups = [/^\d+([.,]\d*)?$/, /^[.,]\d+$/, /^[1-9]\d{0,2}(\.\d{3})+(,\d*)?$/,
    /^[1-9]\d{0,2}(,\d{3})+(\.\d*)?$/]
  if (body === undefined || !groups.some((form) => form.test(body))) {
    return {wrong: "A number such as 1.5 or 2e3, please."}
  }
  const read = (decimal) => Number(sign + [...body].map((character) =>
    character === decimal ? "." : /\d/.test(character) ? character : "").join("") + power)
  const marks = body.match(/[.,]/g) ?? []
  const last = marks.at(-1) ?? null
  const same = marks.length > 1 && marks[0] === last // of thousands
  const value = read(same ? null : last)
  if (marks.length === 1 && plain === spaced && !power && /^[1-9]\d{0,2}[.,]\d{3}$/.test(body)) {
    const other = read(null)
    const [low, high] = column?.range ?? [0, 0]
    const fits = (number) => low <= number && number <= high
    if (!fits(value) || fits(other)) return {wrong: `${value} or ${other}? Please write one of these.`}
  }
  return Number.isFinite(value) ? {value} : {wrong: "A number below 1e308, please."}
}

// ------------------------------------------------------------------------------------------ states

// Objects by the user's names have no prototype: in them __proto__ is a name as any other.
const byName = (entries = []) => {
  const object = Object.create(null)
  for (const [name, value] of entries) object[name] = value
  return object
}

// The state that the page opens with, and what of it does not fit.
const initial = (data) => checked(data, data.opens_with)

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value)
const isEnd = (value) => value === null || (typeof value === "number" && Number.isFinite(value))

// A state from anything that JSON can hold, an address or a file of anybody's. What does not fit
// is dropped and told; nothing is taken over that has not been looked at here.
function checked(data, anything) {
  const remarks = []
  const dropped = (what) => { if (remarks.length < 20) remarks.push(`${what}: left out.`) }
  const given = (key) =>
    isObject(anything) && Object.hasOwn(anything, key) ? anything[key] : undefined
  if (!isObject(anything)) dropped("What should be a state is none")

  // The entries of a mapping by names of columns for which `accepts` says true.
  const entries = (value, columnFits, accepts, what) => {
    if (value === undefined) return byName()
    if (!isObject(value)) return dropped(`${what} that is none`), byName()
    return byName(Object.entries(value).filter(([name, entry]) => {
      const column = data.by.get(name)
      const fits = column !== undefined && column.name === name && columnFits(column)
      if (!fits) dropped(`${what} on ${shown(name)}, which is no such column`)
      else if (!accepts(entry)) dropped(`${what} on ${shown(name)}, which is none`)
      return fits && accepts(entry)
    }))
  }
  const isNumber = (column) => column.texts === null && column.role !== "geometric"
  const isText = (column) => column.texts !== null
  const isPair = (pair) => Array.isArray(pair) && pair.length === 2 && pair.every(isEnd) &&
    !(pair[0] !== null && pair[1] !== null && pair[0] > pair[1])
  const limits = entries(given("limits"), isNumber, isPair, "A limit")
  for (const name of Object.keys(limits)) {
    if (limits[name].every((end) => end === null)) delete limits[name]
    else limits[name] = [...limits[name]]
  }
  const areTexts = (list) => Array.isArray(list) && list.every((text) => typeof text === "string")
  const categories = entries(given("categories"), isText, areTexts, "A choice of categories")
  for (const [name, allowed] of Object.entries(categories)) {
    // Texts that no design has any more allow none; if no text is known, the choice is foreign.
    const {texts} = data.by.get(name)
    categories[name] = texts.filter((text) => allowed.includes(text))
    const lost = new Set(allowed).size - categories[name].length
    if (lost) dropped(`${counted(lost, "category", "categories")} of ${shown(name)} that none has`)
    if (lost && categories[name].length === 0) delete categories[name]
  }

  // Designs by what they are called.
  const designs = (key, most) => {
    const value = given(key)
    if (value === undefined || value === null) return null
    if (!Array.isArray(value)) return dropped(`${key} is no list`), null
    const known = value.filter((id) => typeof id === "string" && data.rowOf.has(id))
    const lost = value.length - known.length
    if (lost) dropped(`${key} names ${counted(lost, "design")} that the page does not have`)
    const distinct = [...new Set(known)]
    if (distinct.length > most) dropped(`More than ${most} in ${key}`)
    return distinct.slice(0, most)
  }
  const design = (key, what) => {
    const id = given(key) ?? null
    if (id === null || (typeof id === "string" && data.rowOf.has(id))) return id
    return dropped(`${what} ${shown(id)}, which the page does not have`), null
  }

  let ranks = given("ranks") ?? null
  if (ranks !== null && !(Array.isArray(ranks) && ranks.every((rank) => RANKS.includes(rank)))) {
    dropped("ranks, which do not fit")
    ranks = null
  }
  const order = given("order")
  const by = isObject(order) ? order.by : null
  const ordered = by === "rank" || by === "preference" || (by === "column" && data.by.has(order.name))
  if (order !== undefined && !ordered) dropped("order, which does not fit")

  const {weights, aspiration} = isObject(given("preference")) ? given("preference") : {}
  const isCriterion = ({role}) => role === "criterion"
  const axes = isObject(given("axes")) ? given("axes") : {}
  const axisNames = (key) => {
    const value = Object.hasOwn(axes, key) ? axes[key] : []
    const fits = Array.isArray(value)
    if (!fits) dropped(`axes.${key}, which is no list`)
    return fits ? [...new Set(value.filter((name) => data.by.has(name)))] : []
  }
  const reason = given("reason") ?? ""
  if (typeof reason !== "string") dropped("reason, which is no text")
  const state = {
    limits,
    categories,
    kept: designs("kept", Infinity),
    ranks: ranks && [...new Set(ranks)],
    dominated: given("dominated") === true,
    pins: designs("pins", MOST_PINS) ?? [],
    base: design("base", "The base of the comparison"),
    chosen: design("chosen", "The chosen design"),
    order: ordered
      ? {by, ...(by === "column" ? {name: order.name} : {}), down: order.down === true}
      : {by: "rank", down: false},
    preference: {
      weights: entries(weights, isCriterion, (weight) => Number.isFinite(weight) && weight >= 0,
        "A weight"),
      aspiration: entries(aspiration, isCriterion, Number.isFinite, "A wished value"),
    },
    axes: {order: axisNames("order"), hidden: axisNames("hidden"), zoom: axes.zoom === true},
    reason: typeof reason === "string" ? reason.slice(0, 10000) : "",
  }
  return {state, remarks}
}

// Anything in a message: as text, and short.
const shown = (value) => {
  const text = typeof value === "string" ? value : JSON.stringify(value) ?? String(value)
  return text.length > 40 ? `${text.slice(0, 40)}…` : text
}

const toHash = (state) => `#${encodeURIComponent(JSON.stringify(state))}`

// What an address says, unchecked; null if it says nothing.
function fromHash(hash) {
  const text = hash.replace(/^#/, "")
  if (!text || text.length > LONGEST_STATE * 3) return null
  try {
    return JSON.parse(decodeURIComponent(text))
  } catch {
    return null
  }
}

// States with undo and redo. They are kept as text, so that what a caller does to one is its own.
function history(first) {
  const states = [JSON.stringify(first)]
  let at = 0
  const now = () => JSON.parse(states[at])
  return {
    push(state) {
      const text = JSON.stringify(state)
      if (text === states[at]) return
      states.splice(at + 1, Infinity, text)
      if (states.length > 200) states.shift()
      at = states.length - 1
    },
    undo() {
      at = Math.max(at - 1, 0)
      return now()
    },
    redo() {
      at = Math.min(at + 1, states.length - 1)
      return now()
    },
    get canUndo() { return at > 0 },
    get canRedo() { return at < states.length - 1 },
  }
}

// ------------------------------------------------------------------------------------------- files

// A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left alone,
// also those written with a comma, a percent sign or an exponent. The command writes CSV likewise.
const inert = (text) =>
  /^[=+\-@\t\r]/.test(text) && !/^[+-]?([\d.,]*(e[+-]?\d+)?%?|inf|infinity|nan)$/i.test(text)
    ? `'${text}` : text

// The head of the CSV, its names written as in the header.
const named = (value) => Array.isArray(value) ? value.map(inert)
  : !isObject(value) ? value
  : Object.fromEntries(Object.entries(value).map(([name, inner]) => [inert(name), named(inner)]))

const markOf = (data, ranking, i) => i >= data.n ? "prototype"
  : !ranking.mask[i] ? "rejected"
  : ranking.isBest[i] ? "Salukvadze optimum"
  : ranking.pareto[i] ? "" : "dominated"

// Rows as CSV, every digit of the numbers, with ranks under the limits. The comment above says what
// the columns are, so that the file comes back with its criteria, directions and units.
function csv(data, rows, ranking) {
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
  const text = (value) => (Number.isNaN(value) ? "" : quoted(inert(String(value))))
  const cells = data.columns.map((column) => {
    const array = values(data, ranking, column)
    return column.texts ? (i) => text(column.texts[array[i]]) : (i) => text(array[i])
  })
  const header = [data.label_name, ...data.columns.map(({role, field, name}) =>
    role === "geometric" ? field : name), "rank", "mark"]
  const lines = [header.map((name) => quoted(inert(name))).join(",")]
  for (const i of rows) {
    const rank = ranking.rank[i] < 0 ? "" : String(ranking.rank[i])
    lines.push([text(data.labels[i]), ...cells.map((cell) => cell(i)), rank,
      markOf(data, ranking, i)].join(","))
  }
  const {head} = data
  const comment = Object.keys(head).length === 0 ? "" : `# ${JSON.stringify(named(head))}\n`
  return `${comment}${lines.join("\n")}\n`
}

const finite = (value) => (Number.isFinite(value) ? value : null)

// The decision as JSON, to be read by people, by the page and by the commands (page/_decision.py).
// Without a choice of the reader's the optimum is what was decided for.
function decisionFile(data, state, ranking, verdict, date) {
  const row = state.chosen !== null ? data.rowOf.get(state.chosen) : verdict?.row ?? null
  const numbers = (role) => byName(data.columns
    .filter((column) => column.role === role)
    .map((column) => [column.name,
      column.texts ? column.texts[column.values[row]] : finite(column.values[row])]))
  const {limits, categories, kept, pins, reason, ...view} = state
  delete view.chosen
  const content = {
    pymoo_psi_decision: 1,
    title: data.title,
    date,
    criteria: data.criteria.map(({name, unit, maximize}) => ({name, unit, maximize})),
    normalize: data.normalize,
    limits,
    categories,
    kept,
    left: ranking.count,
    optimum: verdict === null ? null : data.ids[verdict.row],
    chosen: row === null ? null
      : {label: data.ids[row], criteria: numbers("criterion"), variables: numbers("variable")},
    pins,
    reason,
    verdict: verdict === null ? [] : verdict.sentences,
    view,
  }
  return `${JSON.stringify(content, null, 1)}\n`
}

// What a decision is about that the page is not, so that its limits and ranks would mean something
// else here; "" for nothing: `require` of page/_decision.py.
function foreign(data, {criteria, normalize}) {
  const own = data.criteria
  const theirs = new Map(Array.isArray(criteria) ? criteria.map((one) => [one?.name, one]) : [])
  if (theirs.size !== own.length || !own.every(({name}) => theirs.has(name))) {
    const names = listed([...theirs.keys()].map(shown))
    return `it weighs ${names || "no criteria"}, and the page ${listed(own.map(({name}) => name))}`
  }
  for (const {name, unit, maximize} of own) {
    const there = theirs.get(name)
    if (there.maximize !== maximize) {
      return `there ${name} is ${maximize ? "minimised" : "maximised"}, here it is not`
    }
    if (unit && there.unit && there.unit !== unit) {
      return `there ${name} is in ${shown(there.unit)}, here in ${unit}`
    }
  }
  return normalize === data.normalize ? ""
    : `there designs are ranked ${normalize ? "in units of the ranges" : "by plain distances"}, here not`
}

// The state that a decision file holds, checked as any other, or null if it is about something else.
function opened(data, text) {
  let content = null
  try {
    content = text.length <= LONGEST_STATE * 16 ? JSON.parse(text) : null
  } catch { /* told below */ }
  const unfit = !isObject(content) || content.pymoo_psi_decision !== 1
    ? "it is no decision that a page has saved" : foreign(data, content)
  if (unfit) return {state: null, remarks: [`The file is not opened: ${unfit}.`]}
  const view = isObject(content.view) ? content.view : {}
  const {limits, categories, kept, pins, reason, chosen} = content
  const label = isObject(chosen) ? chosen.label : null
  const entries = {...view, limits, categories, kept, pins, reason, chosen: label}
  const {state, remarks} = checked(data, entries)
  if (state.chosen !== null && isObject(chosen.criteria)) {
    const row = data.rowOf.get(state.chosen)
    const changed = data.criteria.filter(({name, values}) =>
      !Object.hasOwn(chosen.criteria, name) || chosen.criteria[name] !== values[row])
    if (changed.length) {
      const what = listed(changed.map(({name}) => name))
      remarks.unshift(`${capital(called(data, row))} has changed since then in ${what}.`)
    }
  }
  return {state, remarks}
}

return {
  decode, initial, checked, toHash, fromHash, history, values, called, left, ranked, order,
  preference, verdict, explain, compared, compare, stretched, cautions, typed, written, short, csv,
  decisionFile, opened, MOST_PINS,
}
})()

if (typeof module !== "undefined") module.exports = Logic
