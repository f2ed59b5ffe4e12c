// The logic of the decision page: the designs left under the limits, their ranks, the explanation of
// the best, comparisons, preferences, states and files. It touches no document, so that it runs in
// the page and in Node.
//
// Designs are rows 0 … data.n - 1, existing designs (prototypes) the rows behind, up to data.total.
// All arrays have one entry a row. Objectives in data.F are minimised, as in Python; values of a
// column, limits, states and sentences are in the original unit and direction.
//
// Ranks, sentences and preferences equal those of pymoo_psi.pareto and pymoo_psi.selection for the
// same rows; the sentences are the templates of pymoo_psi.pareto.
const Logic = (() => {
"use strict"

const NOISE = 64 * Number.EPSILON // of pareto, where the reasons are, as for the next four
const LAST_PLACES = 8 * Number.EPSILON
const TIE = 1e-9
const STEP = 0.01
const [NEAR, ELSEWHERE, EDGE, OUTWEIGHED, OUTLIER, FEW] = [0.01, 0.1, 0.01, 10, 2, 20]
const PARTS = 64 // of the order of each objective, see `Dominators`
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

// The payload of the file as arrays; its numbers are little-endian float64 in base64.
function decode(payload) {
  const {n, names} = payload
  const columns = payload.columns.map((column) => ({
    ...column,
    values: column.values === null ? null : new Float64Array(bytesOf(column.values)),
    label: column.name + (column.unit ? ` [${column.unit}]` : ""),
  }))
  const objectives = columns.filter(({role}) => role === "objective")
  const F = objectives.map(({maximize, values}) => (maximize ? values.map((value) => -value) : values))
  const data = {
    ...payload,
    columns,
    objectives,
    F,
    total: names.length,
    by: new Map(), // a Map, as any name is one of its keys, also __proto__
    rowOf: new Map(names.map((name, row) => [name, row])),
    optimal: new Uint8Array(bytesOf(payload.optimal)), // among all
    dominator: new Int32Array(n).fill(-1), // found last, see `frontOf`
    dominators: null, // made when a search is needed
    last: null, // the front before
    levels: levelsOf(F),
  }
  // A user's column goes before a geometric one of the same name.
  for (const column of [...columns].reverse()) data.by.set(column.name, column)
  data.whole = ranked(data, new Uint8Array(data.total).fill(1))
  return data
}

// The values of any column, of a geometric one those under the limits.
const values = (data, ranking, column) => column.role === "geometric" ? ranking[column.field] : column.values

// ------------------------------------------------------------------------ order, rounding, dominance

// The rows in the order of their values, NaN last; equal ones stay as they are. A radix sort of the
// bits, as a comparing function takes ten times as long. The upper halves of the numbers tell nearly
// all apart: the lower halves are sorted before only if insertion would take long.
function argsort(values, rows) {
  const n = rows.length
  const numbers = new Float64Array(n)
  for (let k = 0; k < n; k++) numbers[k] = values[rows[k]] + 0 // + 0: -0 equals 0
  const places = upTo(n)
  radix(numbers, places, 1)
  if (!inserted(numbers, places)) {
    places.set(upTo(n))
    radix(numbers, places, 0)
    radix(numbers, places, 1)
  }
  for (let k = 0; k < n; k++) places[k] = rows[places[k]]
  return places
}

// Sort places by the upper (1) or lower (0) halves of numbers.
function radix(numbers, places, half) {
  const n = places.length
  const words = new Uint32Array(numbers.buffer)
  const keys = new Uint32Array(n)
  for (let k = 0; k < n; k++) {
    // As unsigned integers floats stand in order once negative ones are turned, others lifted.
    const high = words[2 * k + 1]
    const mask = high >>> 31 === 0 ? half << 31 : numbers[k] === numbers[k] ? -1 : 0
    keys[k] = words[2 * k + half] ^ mask
  }
  const ends = new Uint32Array(1 << 11)
  for (const shift of [0, 11, 22]) { // 11 bits at a time: so many lists fit into a cache
    ends.fill(0)
    for (let k = 0; k < n; k++) ends[(keys[k] >>> shift) & 2047]++
    if (n === 0 || ends[(keys[0] >>> shift) & 2047] === n) continue // the same in all
    for (let d = 0, total = 0; d < ends.length; d++) {
      const count = ends[d]
      ends[d] = total
      total += count
    }
    const before = places.slice()
    for (let k = 0; k < n; k++) places[ends[(keys[before[k]] >>> shift) & 2047]++] = before[k]
  }
}

// Sort places that are nearly in order by insertion; false if it would take long.
function inserted(numbers, places) {
  let moves = 4 * places.length
  for (let k = 1; k < places.length; k++) {
    const place = places[k]
    let at = k
    for (; at > 0 && numbers[places[at - 1]] > numbers[place]; at--) {
      places[at] = places[at - 1]
      if (--moves < 0) return false
    }
    places[at] = place
  }
  return true
}

function upTo(n) {
  const rows = new Int32Array(n)
  for (let k = 0; k < n; k++) rows[k] = k
  return rows
}

// The rows that a function accepts; the filter of typed arrays takes five times as long.
function picked(rows, accepts) {
  const result = new Int32Array(rows.length)
  let count = 0
  for (let k = 0; k < rows.length; k++) if (accepts(rows[k])) result[count++] = rows[k]
  return result.slice(0, count)
}

function concat(...lists) {
  const result = new Int32Array(sum(lists.map((list) => list.length)))
  let at = 0
  for (const list of lists) {
    result.set(list, at)
    at += list.length
  }
  return result
}

function sum(array) {
  let total = 0
  for (let k = 0; k < array.length; k++) total += array[k]
  return total
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

// How far a group of equal values reaches from its least one.
const reachOf = (least, tolerance) =>
  Math.abs(least) === Infinity ? least : Math.min(least + tolerance, Number.MAX_VALUE)

// Number values from 0 upwards, those within a tolerance of the least of their group alike. `order`
// are the rows by value; `tolerance` null means the noise of the values.
function numbered(values, order, tolerance) {
  const numbers = new Int32Array(values.length)
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

// Objectives as integers, equal where values are equal up to rounding: dominance compares these.
function levelsOf(F) {
  const rows = upTo(F[0].length)
  const exact = F.map(() => true) // no two values of a column are equal up to rounding only
  let chained = false
  const ranks = F.map((values, j) => {
    const order = argsort(values, rows)
    const numbers = numbered(values, order, null)
    for (let k = 1; k < order.length; k++) {
      const before = values[order[k - 1]]
      const value = values[order[k]]
      if (value === before || value > reachOf(before, NOISE * Math.abs(before))) continue
      exact[j] = false
      // Each close to the next, the last far from the first: where such a chain is cut depends on
      // which of its values are left.
      chained ||= numbers[order[k]] !== numbers[order[k - 1]]
    }
    return numbers
  })
  return {ranks, exact, chained}
}

// Finds which of some rows dominates a row.
//
// The order of each objective is cut into parts. What lies in a part or before it is kept as bits,
// one a row: what all objectives have in common holds all that dominate a row of these parts, and a
// few more. Bits follow the sums of the ranks: what dominates stands before. The last that does is
// the most alike, and so the last to go when limits move.
class Dominators {
  constructor(ranks) {
    const n = ranks[0].length
    const sums = new Float64Array(n)
    for (const column of ranks) for (let i = 0; i < n; i++) sums[i] += column[i]
    const order = argsort(sums, upTo(n))
    const place = new Int32Array(n)
    for (let k = 0; k < n; k++) place[order[k]] = k
    Object.assign(this, {ranks, sums, order, place, words: (n + 31) >>> 5})
    this.columns = ranks.map((column) => {
      const most = greatestOf(column) + 1
      const part = Uint8Array.from(column, (rank) => (rank / most) * PARTS)
      const bits = new Int32Array(PARTS * this.words)
      for (let i = 0; i < n; i++) bits[part[i] * this.words + (place[i] >>> 5)] |= 1 << (place[i] & 31)
      for (let at = this.words; at < bits.length; at++) bits[at] |= bits[at - this.words]
      return {part, bits}
    })
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
    const {ranks, sums, order, place, columns, words} = this
    let w = filled[place[i] >>> 5]
    if (w < 0) return -1
    // The objective in which fewest rows are before comes first: little is left for the others.
    const sorted = [...columns].sort((a, b) => a.part[i] - b.part[i])
    const sets = sorted.map((column) => column.bits)
    const starts = sorted.map(({part}) => part[i] * words)
    for (; w >= 0; w = w > 0 ? filled[w - 1] : -1) {
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
// A row that is Pareto optimal among all is so among fewer. A dominated one stays dominated as long
// as the dominator found last is left, and what was optimal in the last call is compared only with
// rows that have come back since: a limit on the worse side of an objective frees no row.
function frontOf(data, mask, rows) {
  const {optimal, dominator, levels} = data
  if (rows.length === data.n) return picked(rows, (i) => optimal[i])
  if (levels.chained) { // dominance depends on the rows left, which is as rare as it is slow
    const ranks = data.F.map((values) => numbered(values, argsort(values, rows), null))
    return rows.filter((i) => !rows.some((k) =>
      ranks.every((column) => column[k] <= column[i]) && ranks.some((column) => column[k] < column[i])))
  }
  const front = new Uint8Array(data.n)
  const open = picked(rows, (i) => {
    front[i] = optimal[i]
    return !optimal[i] && (dominator[i] < 0 || !mask[dominator[i]])
  })
  if (open.length) {
    const dominators = data.dominators ??= new Dominators(levels.ranks)
    const {last} = data
    const all = dominators.among(rows)
    const added = last ? dominators.among(picked(rows, (i) => !last.mask[i])) : all
    for (const i of open) {
      dominator[i] = dominators.of(i, last?.front[i] ? added : all)
      if (dominator[i] < 0) front[i] = 1
    }
  }
  data.last = {mask: mask.slice(), front}
  return picked(rows, (i) => front[i])
}

// The objectives of some rows, those equal up to rounding made the least of them.
function settled(data, rows) {
  return data.F.map((column, j) => {
    const result = new Float64Array(rows.length)
    for (let k = 0; k < rows.length; k++) result[k] = column[rows[k]]
    if (data.levels.exact[j]) return result
    const order = argsort(result, upTo(rows.length))
    const groups = numbered(result, order, null)
    const least = []
    for (const place of order) least[groups[place]] ??= result[place]
    return result.map((_, place) => least[groups[place]])
  })
}

// ---------------------------------------------------------------------------- ranks of efficiency

const farIfNaN = (value) => (Number.isNaN(value) ? Infinity : value)

// The points U and N of a front and what distances are measured in (pareto's UtopianFrame).
class Frame {
  constructor(V, normalize) {
    this.ideal = V.map(leastOf)
    this.nadir = V.map(greatestOf)
    this.size = this.ideal.map((low, j) => Math.max(Math.abs(low), Math.abs(this.nadir[j])))
    this.lengths = this.ideal.map((low, j) => { // infinite where the range is none
      const range = this.nadir[j] - low
      return range > NOISE * this.size[j] ? range : Infinity
    })
    this.scale = normalize ? this.lengths : this.lengths.map(() => 1)
    this.line = this.lengths.map((length, j) =>
      Number.isFinite(length) ? (this.nadir[j] - this.ideal[j]) / this.scale[j] : 0)
    const most = Math.max(...this.line) || 1
    const norm = Math.sqrt(sum(this.line.map((value) => (value / most) ** 2))) || 1
    this.direction = this.line.map((value) => value / most / norm)
  }

  // Three arrays of `size`, μ1 to μ3 of some rows of F and NaN elsewhere, and their units, in which
  // no square over- or underflows.
  measured(F, rows, size) {
    const {ideal, scale, line, direction: e} = this
    const longest = line.indexOf(Math.max(...line))
    const unit = line[longest] || 1
    const acrossUnit = Math.max(0, ...line.filter((_, j) => j !== longest)) || unit
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
      mu1[i] = farIfNaN(Math.sqrt(square))
      mu2[i] = farIfNaN(Math.sqrt(squareAcross))
      mu3[i] = farIfNaN(onLine)
    }
    return [mu, [unit, acrossUnit, unit]]
  }

  // The rounding errors of the three criteria.
  noise(units) {
    const e2 = this.direction.map((value) => value * value)
    const across = e2.map((_, j) => Math.sqrt(sum(e2.filter((_, k) => k !== j))))
    const sizes = this.sizes()
    return [e2.map(() => 1), across, this.direction].map((parts, k) =>
      LAST_PLACES * Math.hypot(...parts.map((part, j) => (part * sizes[j]) / units[k])))
  }

  // How large the values of each objective are in the scale.
  sizes() {
    return this.lengths.map((length, j) => Number.isFinite(length) ? this.size[j] / this.scale[j] : 0)
  }
}

// Mark the rows whose points (a, b) no other dominates; of equal ones those of the least `other`.
// All are levels, small integers.
function nondominatedPair(rows, a, b, other) {
  const first = new Int32Array(rows.length).fill(-1) // by a, the row of the least b, then other
  for (const i of rows) {
    const j = first[a[i]]
    if (j < 0 || b[i] < b[j] || (b[i] === b[j] && other[i] < other[j])) first[a[i]] = i
  }
  let low = Infinity
  for (const j of first) {
    if (b[j] < low) low = b[j]
    else if (j >= 0) first[a[j]] = -1
  }
  const mask = new Uint8Array(a.length)
  for (const i of rows) {
    const j = first[a[i]]
    if (j >= 0 && b[i] === b[j] && other[i] === other[j]) mask[i] = 1
  }
  return mask
}

// The ranking of the rows left (pareto's rank_of_efficiency).
//   mask, rows, count     what was ranked, without prototypes
//   front, byMu1          the Pareto-optimal rows, and these with the nearest to the ideal first
//   pareto, rank          by row; the rank of a prototype and of a row not left is -1
//   mu1, mu2, mu3         by row, of prototypes too
//   ideal, nadir          in the original direction
//   best, isBest          the rows of the Salukvadze optimum; the same by row
//   frame, V              the points U and N; the objectives of the front, column by column
function ranked(data, mask) {
  const {n, total, F, levels: {exact}} = data
  const rows = picked(upTo(n), (i) => mask[i])
  const pareto = new Uint8Array(total)
  const rank = new Int8Array(total).fill(-1)
  const isBest = new Uint8Array(total)
  const front = rows.length ? frontOf(data, mask, rows) : rows
  const V = settled(data, front)
  const frame = new Frame(V, data.normalize)
  const all = rows.length ? concat(rows, upTo(total).subarray(n)) : rows
  const settledF = F.map((column, j) => {
    if (exact[j]) return column
    const copy = column.slice()
    front.forEach((i, k) => { copy[i] = V[j][k] })
    return copy
  })
  const [mu, units] = frame.measured(settledF, all, total)
  const noise = frame.noise(units)
  const orders = mu.map((column) => argsort(column, front))
  const [l1, l2, l3] = mu.map((column, k) => numbered(column, orders[k], noise[k]))
  const p12 = nondominatedPair(front, l1, l2, l3)
  const p13 = nondominatedPair(front, l1, l3, l2)
  const p23 = nondominatedPair(front, l2, l3, l1)
  for (let k = 0; k < rows.length; k++) rank[rows[k]] = 0
  for (let k = 0; k < front.length; k++) {
    const i = front[k]
    pareto[i] = 1
    // P12 and P13 lie inside P23 but for the tolerance.
    rank[i] = 3 * (p23[i] | p12[i] | p13[i]) + 2 * p13[i] + p12[i]
  }
  const best = [...picked(front, (i) => l1[i] === 0)]
  for (const i of best) isBest[i] = 1
  mu.forEach((column, k) => {
    for (let at = 0; at < all.length; at++) column[all[at]] *= units[k]
  })
  const turned = (point) => point.map((value, j) => (data.objectives[j].maximize ? -value : value) + 0)
  return {mask, rows, count: rows.length, front, byMu1: orders[0], pareto, rank, mu1: mu[0],
    mu2: mu[1], mu3: mu[2], ideal: turned(frame.ideal), nadir: turned(frame.nadir), best, isBest,
    frame, V}
}

// ------------------------------------------------------------------------------------------ limits

// By how much a limit is moved to show what it keeps out: a twentieth of the range of its column.
function relaxed({range: [low, high], log}, value, towards) {
  if (log && value > 0) return value * (high / low) ** (0.05 * towards)
  return value + 0.05 * towards * (high - low)
}

// The designs within all limits, and what each limit rejects. A value that is missing keeps none.
//   mask, count    prototypes are always in the mask and never counted
//   rejects, only  by name of the column: designs that a limit rejects; that nothing else rejects
//   relax          by name: {low, high}, each null or {value, back}: a limit a little farther out
//                  and how many designs it would bring back
function left(data, state) {
  const {n, total} = data
  const conditions = new Map() // by name, which rows are rejected
  for (const [name, [low, high]] of Object.entries(state.limits)) {
    const {values} = data.by.get(name)
    const rejected = new Uint8Array(n)
    const [least, most] = [low ?? -Number.MAX_VALUE, high ?? Number.MAX_VALUE]
    for (let i = 0; i < n; i++) rejected[i] = values[i] >= least && values[i] <= most ? 0 : 1
    conditions.set(name, rejected)
  }
  for (const [name, allowed] of Object.entries(state.categories)) {
    const {values, texts} = data.by.get(name)
    const out = texts.map((text) => (allowed.includes(text) ? 0 : 1))
    conditions.set(name, Uint8Array.from(values.subarray(0, n), (place) => out[place]))
  }
  const times = new Uint32Array(n) // by how many conditions a design is rejected
  for (const rejected of conditions.values()) for (let i = 0; i < n; i++) times[i] += rejected[i]
  if (state.kept !== null) {
    const kept = new Set(state.kept.map((name) => data.rowOf.get(name)))
    for (let i = 0; i < n; i++) if (!kept.has(i)) times[i] += 2 // no relaxed limit brings it back
  }
  const mask = new Uint8Array(total).fill(1)
  for (let i = 0; i < n; i++) mask[i] = times[i] ? 0 : 1
  const [rejects, only, relax] = [new Map(), new Map(), new Map()]
  for (const [name, rejected] of conditions) {
    rejects.set(name, sum(rejected))
    const alone = picked(upTo(n), (i) => rejected[i] && times[i] === 1)
    only.set(name, alone.length)
    const column = data.by.get(name)
    if (column.texts || !(column.range[0] < column.range[1])) continue
    const ends = state.limits[name]
    const back = (k) => {
      if (ends[k] === null) return null
      const value = relaxed(column, ends[k], k ? 1 : -1)
      const [low, high] = k ? [ends[0], value] : [value, ends[1]]
      return {value, back: picked(alone, (i) => column.values[i] >= (low ?? -Number.MAX_VALUE)
        && column.values[i] <= (high ?? Number.MAX_VALUE)).length}
    }
    relax.set(name, {low: back(0), high: back(1)})
  }
  return {mask, count: sum(mask) - (total - n), rejects, only, relax}
}

// ------------------------------------------------------------------------------------- the orders

// The rows shown, prototypes first, then the best design first; dominated designs come last but
// where they are sorted by a column.
function order(data, ranking, state) {
  const {by, name, down} = state.order
  const {pareto, rank, isBest} = ranking
  const hasRank = RANKS.map((r) => state.ranks === null || state.ranks.includes(r))
  const shows = (i) => pareto[i] ? hasRank[rank[i]] || (hasRank[6] && isBest[i]) : state.dominated
  const prototypes = upTo(data.total).subarray(data.n)
  const turned = (list) => (down ? list.slice().reverse() : list)
  if (by === "column") {
    const column = data.by.get(name)
    const array = values(data, ranking, column)
    if (column.role !== "geometric") column.sorted ??= argsort(column.values, upTo(data.n))
    const sorted = column.role === "geometric" ? argsort(array, picked(ranking.rows, shows))
      : picked(column.sorted, (i) => ranking.mask[i] && shows(i))
    const known = picked(sorted, (i) => !Number.isNaN(array[i]))
    return concat(prototypes, turned(known), sorted.subarray(known.length)) // missing ones last either way
  }
  const dominated = state.dominated ? picked(ranking.rows, (i) => !pareto[i]) : new Int32Array(0)
  if (by === "preference") {
    const {value, total, best} = preference(data, ranking, state.preference)
    const first = best.filter(shows) // as rounding would order those that tie
    const others = picked(ranking.front, (i) => !best.includes(i) && shows(i))
    const ordered = concat(first, argsort(value, argsort(total, others)))
    return concat(prototypes, turned(ordered), turned(argsort(value, dominated)))
  }
  const nearest = picked(ranking.byMu1, shows)
  const efficient = picked(nearest, (i) => rank[i] > 0)
  const byRank = [6, 5, 4, 3].map((r) => picked(efficient, (i) => rank[i] === r))
  byRank.push(picked(nearest, (i) => rank[i] === 0))
  return concat(prototypes, turned(concat(...byRank)), turned(argsort(ranking.mu1, dominated)))
}

// The achievement function of every row left, max w (f - r) / range, the least of which is chosen,
// and the sum of its terms, which decides ties (selection's ReferencePoint). Without an aspiration
// an objective is measured from its best value; weights are 1 unless given.
function preference(data, ranking, {weights, aspiration}) {
  const {objectives, n} = data
  const value = new Float64Array(data.total).fill(NaN)
  const total = value.slice()
  if (ranking.count === 0) return {value, total, best: []}
  const {frame, front, V} = ranking
  const given = objectives.map(({name}) => (Object.hasOwn(weights, name) ? weights[name] : 1))
  const most = Math.max(...given)
  const ratios = given.map((weight) => (most > 0 ? weight / most : 1))
  const w = ratios.map((ratio) => ratio / sum(ratios))
  const point = objectives.map(({name, maximize}, j) => {
    if (!Object.hasOwn(aspiration, name)) return frame.ideal[j]
    return maximize ? -aspiration[name] : aspiration[name]
  })
  const measure = (columns, k, row) => {
    let greatest = -Infinity
    let all = 0
    for (let j = 0; j < columns.length; j++) {
      const term = w[j] * ((columns[j][k] - point[j]) / frame.scale[j])
      if (term > greatest) greatest = term
      all += term
    }
    value[row] = greatest
    total[row] = all
  }
  for (const i of ranking.rows) measure(data.F, i, i)
  for (let i = n; i < data.total; i++) measure(data.F, i, i)
  for (let k = 0; k < front.length; k++) measure(V, k, front[k])
  const noise = frame.sizes().map((size, j) =>
    LAST_PLACES * w[j] * Math.max(size, Math.abs(point[j] / frame.scale[j])))
  const nearest = (list, key, tolerance) => {
    const reach = reachOf(leastOf(list.map((i) => key[i])), tolerance)
    return list.filter((i) => key[i] <= reach)
  }
  const best = nearest(nearest([...front], value, Math.max(...noise)), total, sum(noise))
  return {value, total, best}
}

// ----------------------------------------------------------------------------------------- wording

// A template of pareto, filled.
const sentence = (data, name, parts) =>
  data.sentences[name].replace(/\{(\w+)\}/g, (_, part) => parts[part])

// A name that the user gave stays as it is.
const capital = (text) => text.replace(/^(design|row|test point) /, (ours) =>
  ours[0].toUpperCase() + ours.slice(1))
const listed = (names) =>
  names.length > 1 ? `${names.slice(0, -1).join(", ")} and ${names.at(-1)}` : names.join("")
const counted = (n, one) => `${n} ${one}${n === 1 ? "" : "s"}`

// The digits of a number as Python rounds them, an exact half to the even digit: 62.5 -> 6.2e+1.
function rounded(value, digits) {
  const up = value.toExponential(digits - 1) // of an exact half the larger one
  const [mantissa, exponent] = Math.abs(value).toExponential(60).split("e")
  const all = mantissa.replace(".", "")
  const half = all[digits] === "5" && /^0*$/.test(all.slice(digits + 1))
  if (!half || Number(all[digits - 1]) % 2) return up
  return `${value < 0 ? "-" : ""}${all[0]}.${all.slice(1, digits)}e${exponent}`
}

// A number with a few digits as Python's format "g" writes it, large ones without an exponent.
function short(value, digits = 4) {
  if (value === 0 || !Number.isFinite(value)) return String(value).replace("Infinity", "inf")
  const text = rounded(value, digits)
  const [mantissa, power] = text.split("e").map(Number)
  if (power >= -4 && (power < digits || Math.abs(value) < 1e7)) {
    return Number(text).toFixed(Math.max(0, digits - 1 - power)).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "")
  }
  return `${mantissa}e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`
}

// A share with two digits, above 10 % with none behind the point.
function percent(share) {
  const hundreds = 100 * share
  if (hundreds > 0 && hundreds < 0.01) return "less than 0.01 %"
  if (!(hundreds >= 9.95) || hundreds === Infinity) return `${short(hundreds, 2)} %`
  return `${Number(rounded(hundreds, hundreds < 10 ? 1 : Math.floor(Math.log10(hundreds)) + 1)).toFixed(0)} %`
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

// A change of one objective in words.
function changed(data, j, amount, share, first) {
  const {name, unit} = data.objectives[j]
  const key = Number.isNaN(share) ? "bare change" : first ? "first change" : "change"
  return sentence(data, key, {objective: name, share: percent(share),
    amount: short(amount) + (unit ? ` ${unit}` : "")})
}

// Where a design is better than another and where worse, in words.
function difference(data, gains, shares) {
  const size = (j) => (Number.isNaN(shares[j]) ? -1 : Math.abs(shares[j]))
  const places = gains.map((_, j) => j).sort((a, b) => size(b) - size(a) || a - b)
  let first = true
  const parts = [["better", 1], ["worse", -1]].map(([key, sign]) => {
    const changes = places.filter((j) => sign * gains[j] > 0).map((j) => {
      const text = changed(data, j, Math.abs(gains[j]), Math.abs(shares[j]), first)
      first = false
      return text
    })
    return changes.length ? sentence(data, key, {changes: changes.join(", ")}) : ""
  })
  return parts.filter(Boolean).join("; ") || sentence(data, "equal", {})
}

// The objectives of the front and of further rows, those equal up to rounding made the same.
function withRows(data, {front, V}, rows) {
  if (data.levels.exact.every(Boolean)) { // as is usual: nothing to be copied
    return {V, own: data.F.map((column) => rows.map((row) => column[row]))}
  }
  const together = settled(data, [...front, ...rows])
  return {
    V: together.map((column) => column.subarray(0, front.length)),
    own: together.map((column) => [...column.subarray(front.length)]),
  }
}

// Gains of rows against the first of them and shares of the ranges, a list each.
function gainsOf(data, ranking, rows) {
  const {own} = withRows(data, ranking, rows)
  const gains = rows.map((_, k) => own.map((column) => column[0] - column[k] + 0))
  const shares = gains.map((list) => list.map((gain, j) => shareOf(gain, ranking.frame.lengths[j])))
  return {gains, shares}
}

// The rows to compare, the base first: what the reader has made the base, else the existing design,
// else what is pinned first, else the optimum of all designs. Beside it stand the best, the chosen
// one and what is pinned; if that is one design alone, the next by rank. Each: `{row, roles}`.
function compared(data, ranking, state) {
  if (ranking.count === 0) return []
  const row = (name) => data.rowOf.get(name) ?? -1
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
  const roles = [[base, "base"], [best, "best"], [chosen, "chosen"], [next, "next by rank"],
    [best === whole ? -1 : whole, "best without limits"]]
  return [...rows].map((i) => ({
    row: i, roles: roles.filter(([one]) => one === i).map(([, role]) => role),
  }))
}

// What rows give and take against one of them. `better` is 1, 0 or -1; `percent` is of the size of
// the other's value, `share` of the range of the Pareto set, above 0 where it is better.
function compare(data, ranking, rows, base) {
  const {gains, shares} = gainsOf(data, ranking, [base, ...rows])
  const objectives = data.objectives.map(({name, maximize, values}, j) => {
    const differences = rows.map((_, k) => (maximize ? 1 : -1) * gains[k + 1][j] + 0)
    return {
      name,
      values: rows.map((row) => values[row]),
      differences,
      percent: differences.map((d) => (d === 0 ? 0 : (100 * d) / Math.abs(values[base]))),
      share: rows.map((_, k) => shares[k + 1][j]),
      better: rows.map((_, k) => Math.sign(gains[k + 1][j])),
    }
  })
  const sentences = rows.map((row, k) => sentence(data, "against", {design: capital(data.names[row]),
    other: data.names[base], difference: difference(data, gains[k + 1], shares[k + 1])}))
  return {objectives, sentences}
}

// Why a design: its distances from the best, and what the nearest design that is better in an
// objective costs in the others (pareto's explain). Any row, also dominated or a prototype.
function explain(data, ranking, row) {
  const {front, frame: {lengths}, pareto} = ranking
  const {objectives, names} = data
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
    let best = -1
    let reach = Infinity
    for (const ties of [false, true]) {
      for (let k = 0; k < n; k++) {
        const gain = value - column[k]
        if (!(distance[k] <= reach && gain > 0 && gain >= step)) continue
        if (!ties) reach = distance[k]
        else if (best < 0 || column[k] < column[best]) best = k
      }
      reach *= 1 + TIE
    }
    return best
  }
  const neighbours = V.map((column, j) => {
    const near = nearest(column, own[j], STEP * lengths[j])
    return front[near >= 0 ? near : nearest(column, own[j], 0)] ?? -1
  })
  let dominatedBy = -1
  if (!pareto[row]) {
    // The least excess, not none: a chain of close values may be settled otherwise here.
    const excess = new Float64Array(n)
    V.forEach((column, j) => {
      for (let k = 0; k < n; k++) excess[k] = Math.max(excess[k], (column[k] - own[j]) / lengths[j] || 0)
    })
    const least = leastOf(excess)
    dominatedBy = front[nearest(excess.map((value) => (value === least ? 0 : 1)), 0.5, 0)]
  }
  const sizes = shares.map((share) => (Number.isNaN(share) ? Infinity : share))
  const ordered = shares.map((_, j) => j).sort((a, b) => sizes[b] - sizes[a] || a - b)
  const most = Math.max(0, ...shares.filter((share) => !Number.isNaN(share)))
  const weakest = objectives.filter((_, j) => most > 0 && shares[j] >= most * (1 - TIE)).map(({name}) => name)
  const steps = [] // a neighbour towards several objectives is one step
  for (const j of ordered.filter((j) => neighbours[j] >= 0)) {
    const same = steps.find((step) => step.row === neighbours[j])
    if (same) same.names.push(objectives[j].name)
    else steps.push({names: [objectives[j].name], row: neighbours[j]})
  }
  const against = gainsOf(data, ranking, [row, ...steps.map((step) => step.row)])
  steps.forEach((step, k) => { step.text = difference(data, against.gains[k + 1], against.shares[k + 1]) })
  return {
    row,
    objectives: objectives.map(({name, values}, j) => ({
      name, value: values[row], best: ranking.ideal[j], away: behind[j], share: shares[j],
    })),
    weakest,
    steps,
    sentences: [
      standing(data, ranking, row, dominatedBy),
      distances(data, ranking, ordered, behind, shares, weakest),
      ...steps.map((step) => sentence(data, "step",
        {objectives: listed(step.names), design: names[step.row], difference: step.text})),
    ],
  }
}

// What a design is among the others, as a sentence.
function standing(data, ranking, row, dominatedBy) {
  const {front, best, isBest, rank, mask} = ranking
  const parts = {design: capital(data.names[row]), front: counted(front.length, "Pareto-optimal design"),
    count: best.length, rank: rank[row]}
  if (row >= data.n) return `${parts.design} is not among the designs that are ranked.`
  if (!mask[row]) return `${parts.design} is beyond the limits.`
  if (dominatedBy >= 0) {
    const {gains, shares} = gainsOf(data, ranking, [row, dominatedBy])
    parts.other = data.names[dominatedBy]
    parts.difference = difference(data, gains[1], shares[1])
    return sentence(data, "dominated", parts)
  }
  const key = front.length === 1 ? "single" : !isBest[row] ? "ranked" : best.length === 1 ? "optimum" : "optima"
  return sentence(data, key, parts)
}

// How far a design is from the best of each objective, as a sentence.
function distances(data, {frame}, ordered, behind, shares, weakest) {
  const names = (there) => listed(data.objectives.filter((_, j) => there(j)).map(({name}) => name))
  const away = ordered.filter((j) => behind[j] > 0)
  if (!away.length) return sentence(data, "all best", {})
  const changes = away.map((j, k) => changed(data, j, behind[j], shares[j], k === 0)).join(", ")
  const best = names((j) => behind[j] === 0 && frame.lengths[j] !== Infinity)
  return `${[
    sentence(data, "behind", {changes}),
    away.length > 1 && weakest.length ? sentence(data, "weakest", {objectives: listed(weakest)}) : "",
    best && sentence(data, "best", {objectives: best}),
  ].filter(Boolean).join("; ")}.`
}

// The best compromise under the limits, why, and how far its weakest objective is from the best if
// that is beyond the middle of the range; null if nothing is left.
function verdict(data, ranking) {
  if (ranking.count === 0) return null
  const best = explain(data, ranking, ranking.best[0])
  const worst = Math.max(...best.objectives.map(({share}) => share))
  const first = data.whole.best[0]
  return {
    ...best,
    warning: worst > 0.5 && ranking.front.length > 1
      ? `In ${listed(best.weakest)} it is ${percent(worst)} of the range away from the best.` : "",
    ties: ranking.best,
    whole: data.whole.isBest[best.row] ? null : {row: first, sentence: `Without limits it would be ` +
      `${data.names[first]}. ${compare(data, data.whole, [best.row], first).sentences[0]}`},
  }
}

// ---------------------------------------------------------------------------------------- cautions

// What speaks against relying on the optimum, in sentences (pareto's cautions). It ranks anew up to
// twice for each objective, so not for every step of a slider.
function cautions(data, ranking) {
  const {front, frame: {lengths}, V, best, isBest, count} = ranking
  if (count === 0) return []
  const n = front.length
  const columns = V.map((_, j) => j)
  const names = (places) => listed(places.map((j) => data.objectives[j].name))
  const name = (k) => data.names[front[k]]
  const found = []
  const say = (key, parts) => found.push(sentence(data, key, parts))
  const low = V.map(leastOf)
  const D = V.map((column, j) => column.map((value) => (value - low[j]) / lengths[j]))
  const varying = columns.filter((j) => greatestOf(D[j]) > 0)
  if (!varying.length) {
    if (count > 1 && V.length > 1) say("alone", {})
    return found
  }
  const constant = columns.filter((j) => !varying.includes(j))
  if (constant.length) say("constant", {objectives: names(constant)})
  const groups = []
  for (let rest = varying; n > 2 && rest.length;) {
    const same = rest.filter((j) => D[j].every((d, k) => Math.abs(d - D[rest[0]][k]) <= EDGE))
    if (same.length > 1) groups.push(names(same))
    rest = rest.filter((j) => !same.includes(j))
  }
  if (groups.length) say("redundant", {groups: groups.join("; ")})
  const ranges = V.map((column, j) => greatestOf(column) - low[j])
  const widest = varying.reduce((a, j) => (ranges[j] > ranges[a] ? j : a))
  const least = varying.reduce((a, j) => (ranges[j] < ranges[a] ? j : a))
  if (!data.normalize && ranges[widest] >= OUTWEIGHED * ranges[least]) {
    say("scale", {objective: names([widest]), range: short(ranges[widest], 3), other: names([least]),
      least: short(ranges[least], 3)})
  }

  const mu = Float64Array.from(front, (i) => ranking.mu1[i])
  const optimum = front.indexOf(best[0])
  const near = upTo(n).filter((k) => mu[k] <= mu[optimum] * (1 + NEAR))
  const spread = Math.max(...D.map((column) => {
    const shares = Float64Array.from(near, (k) => column[k])
    return greatestOf(shares) - leastOf(shares)
  }))
  if (near.length >= 3 && 2 * near.length > n && spread > 0.5) {
    say("equidistant", {near: near.length, count: n})
  } else {
    aboutOptimum()
  }
  const ranked = front.filter((i) => ranking.rank[i] > 0).length
  if (n >= FEW && 2 * ranked > n) say("unselective", {ranked, count: n})
  return found

  function aboutOptimum() {
    const steps = (k) => D.map((column) => Math.abs(column[k] - column[optimum]))
    const apart = (k) => Math.max(...steps(k))
    const ties = best.map((row) => front.indexOf(row)).filter((k) => apart(k) > EDGE)
    if (ties.length) {
      const others = [name(ties[0]), ...(ties.length > 1 ? [`${ties.length - 1} more`] : [])]
      say("tie", {design: capital(name(optimum)), others: listed(others)})
    }
    const others = near.filter((k) => !isBest[front[k]] && apart(k) > ELSEWHERE)
    if (others.length) {
      const other = others.reduce((a, k) => (mu[k] < mu[a] ? k : a))
      say("near tie", {design: capital(name(other)), farther: percent(mu[other] / mu[optimum] - 1),
        share: percent(apart(other)), objective: names([steps(other).indexOf(apart(other))])})
    }
    const worst = columns.filter((j) => D[j][optimum] >= 1 - EDGE)
    if (worst.length && n > 2) say("extreme", {objectives: names(worst)})
    const first = varying.filter((j) => D[j][optimum] <= EDGE)
    if (first.length && n > 2) say("edge", {objectives: names(first)})
    const ends = D.flatMap((column) => [0, 1].map((share) => upTo(n).filter((k) => column[k] === share)))
    const alone = new Set(ends.filter((at) => at.length === 1 && !isBest[front[at[0]]]).map(([k]) => k))
    const moves = [...alone].map((k) => without(data, ranking, front[k]))
    const most = moves.reduce((a, b) => (b.moved > a.moved ? b : a), {moved: ELSEWHERE})
    if (most.key) say(most.key, most.parts)
  }
}

// How far the optimum moves without a design of the front, and the template and parts that say so.
function without(data, ranking, row) {
  const {best, isBest, V} = ranking
  const mask = ranking.mask.slice()
  mask[row] = 0
  const front = frontOf(data, mask, picked(ranking.rows, (i) => i !== row))
  const columns = settled(data, front)
  const frame = new Frame(columns, data.normalize)
  const [[mu]] = frame.measured(columns, upTo(front.length), front.length)
  const reach = leastOf(mu) * (1 + TIE)
  const optima = [...upTo(front.length)].filter((k) => mu[k] <= reach)
  if (optima.some((k) => isBest[front[k]])) return {moved: 0}
  const moves = optima.flatMap((k) => best.map((old) => {
    const at = ranking.front.indexOf(old)
    const steps = columns.map((column, j) => Math.abs(column[k] - V[j][at]) / frame.lengths[j])
    const moved = Math.max(...steps)
    return {k, moved, j: steps.indexOf(moved)}
  }))
  const {k, moved, j} = moves.reduce((a, b) => (b.moved < a.moved ? b : a))
  const times = V.map((column, j) => (greatestOf(column) - leastOf(column)) / frame.lengths[j])
  const most = Math.max(...times)
  const name = data.names[row]
  return {moved, key: most >= OUTLIER ? "outlier" : "unstable", parts: {
    design: most >= OUTLIER ? capital(name) : name, stretched: data.objectives[times.indexOf(most)].name,
    times: short(most, 3), other: data.names[front[k]], share: percent(moved), objective: data.objectives[j].name,
  }}
}

// Objectives of which Pareto-optimal designs lie far beyond all others, as penalties do, and stretch
// the range by which all are ranked: how many, the farthest value, and the limits without them.
function stretched(data, ranking) {
  return data.objectives.filter(({clipped}) => clipped > 0).map((column) => {
    const [low, high] = column.range
    const beyond = [...ranking.front].map((i) => column.values[i]).filter((value) => value < low || value > high)
    return {column, count: beyond.length, worst: beyond.reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a), 0),
      ends: [leastOf(beyond) < low ? low : null, greatestOf(beyond) > high ? high : null]}
  }).filter(({count}) => count > 0)
}

// ------------------------------------------------------------------------------------ typed numbers

// A number as a reader typed it: {value}, which is null for nothing, or {wrong}, what to type instead.
// A point is decimal, and so is a comma but where it may separate thousands.
function typed(text) {
  const plain = text.trim().replace(/[−–]/g, "-")
  if (plain === "") return {value: null}
  if (!/^[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?$/i.test(plain)) return {wrong: "A number such as 1.5 or 2e3, please."}
  if (/^[+-]?[1-9]\d{0,2},\d{3}$/.test(plain)) {
    return {wrong: `${plain.replace(",", ".")} or ${plain.replace(",", "")}? Please write one of these.`}
  }
  const value = Number(plain.replace(",", "."))
  return Number.isFinite(value) ? {value} : {wrong: "A number below 1e308, please."}
}

// ------------------------------------------------------------------------------------------ states

const isObject = (value) => typeof value === "object" && value !== null && !Array.isArray(value)

// An entry of untrusted input; undefined if there is none.
const entryOf = (object, name) =>
  isObject(object) && Object.hasOwn(object, name) ? object[name] ?? undefined : undefined

// Objects by the user's names have no prototype: in them __proto__ is a name as any other.
const byName = (entries = []) => {
  const object = Object.create(null)
  for (const [name, value] of entries) object[name] = value
  return object
}

// A state from untrusted input, an address or a file. What does not fit is left out and named in a
// remark.
function checked(data, anything) {
  const given = (key, object = anything) => entryOf(object, key)
  const lost = new Set(isObject(anything) ? [] : ["what should be a state"])
  const fitting = (key, fits, otherwise, object) => {
    const value = given(key, object)
    if (value === undefined || fits(value)) return value ?? otherwise
    lost.add(key)
    return otherwise
  }
  // The entries of a mapping, by names of columns, and of a list that fit.
  const entries = (key, fits, object) => byName(Object.entries(fitting(key, isObject, {}, object)).filter(
    ([name, value]) => (data.by.get(name)?.name === name && fits(data.by.get(name), value)) || (lost.add(key), false)))
  const items = (key, fits, object) => [...new Set(fitting(key, Array.isArray, [], object).filter(
    (item) => fits(item) || (lost.add(key), false)))]
  const isDesign = (name) => typeof name === "string" && data.rowOf.has(name)
  const isNumber = ({texts, role}) => texts === null && role !== "geometric"
  const isPair = (pair) => Array.isArray(pair) && pair.length === 2 &&
    pair.every((end) => end === null || Number.isFinite(end)) && !(pair[0] !== null && pair[1] !== null && pair[0] > pair[1])

  const limits = entries("limits", (column, pair) => isNumber(column) && isPair(pair))
  for (const [name, pair] of Object.entries(limits)) if (pair.every((end) => end === null)) delete limits[name]
  // Texts that no design has any more allow none; if no text is known, the choice is foreign.
  const categories = entries("categories", ({texts}, list) => texts !== null && Array.isArray(list) &&
    (list.length === 0 || list.some((text) => texts.includes(text))))
  for (const [name, list] of Object.entries(categories)) {
    categories[name] = data.by.get(name).texts.filter((text) => list.includes(text))
    if (categories[name].length < list.length) lost.add("categories")
  }
  const ranks = given("ranks") === undefined ? null : items("ranks", (rank) => RANKS.includes(rank))
  const isOrder = ({by, name}) => by === "rank" || by === "preference" || (by === "column" && data.by.has(name))
  const order = fitting("order", (value) => isObject(value) && isOrder(value), {by: "rank"})
  const [preference, axes] = [given("preference") ?? {}, given("axes") ?? {}]
  const isObjective = ({role}) => role === "objective"
  const state = {
    limits,
    categories,
    kept: given("kept") === undefined ? null : items("kept", isDesign),
    ranks: ranks?.length === 0 && lost.has("ranks") ? null : ranks,
    dominated: given("dominated") === true,
    pins: items("pins", isDesign).slice(0, MOST_PINS),
    base: fitting("base", isDesign, null),
    chosen: fitting("chosen", isDesign, null),
    order: {by: order.by, ...(order.by === "column" ? {name: order.name} : {}), down: order.down === true},
    preference: {
      weights: entries("weights", (column, weight) => isObjective(column) && Number.isFinite(weight) && weight >= 0, preference),
      aspiration: entries("aspiration", (column, value) => isObjective(column) && Number.isFinite(value), preference),
    },
    axes: {order: items("order", (name) => data.by.has(name), axes),
      hidden: items("hidden", (name) => data.by.has(name), axes), zoom: given("zoom", axes) === true},
    reason: fitting("reason", (text) => typeof text === "string", "").slice(0, 10000),
  }
  if (!Array.isArray(given("kept") ?? [])) state.kept = null
  return {state, remarks: lost.size ? [`Left out, as it does not fit these designs: ${[...lost].join(", ")}.`] : []}
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

// ------------------------------------------------------------------------------------------- files

// A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left alone.
const inert = (text) =>
  /^'*(?![+-]?([\d.,]*(e[+-]?\d+)?%?|inf|infinity|nan)$)[=+\-@＝＋－＠\t\r\n]/i.test(text)
    ? `'${text}` : text

// The head of the CSV, its names written as in the header; a comma in them would begin a cell.
const named = (value) => Array.isArray(value) ? value.map(named)
  : typeof value === "string" ? inert(value)
  : !isObject(value) ? value
  : Object.fromEntries(Object.entries(value).map(([name, inner]) => [inert(name), named(inner)]))

const markOf = (data, ranking, i) => i >= data.n ? "prototype"
  : !ranking.mask[i] ? "rejected"
  : ranking.isBest[i] ? "Salukvadze optimum"
  : ranking.pareto[i] ? "" : "dominated"

// Rows as CSV, every digit of the numbers, with ranks under the limits. The comment above says what
// the columns are, so that the file comes back with its objectives, directions and units.
function csv(data, rows, ranking) {
  const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text)
  const text = (value) => (Number.isNaN(value) ? "" : quoted(inert(String(value))))
  const cells = data.columns.map((column) => {
    const array = values(data, ranking, column)
    return column.texts ? (i) => text(column.texts[array[i]]) : (i) => text(array[i])
  })
  const header = [data.label, ...data.columns.map(({role, field, name}) =>
    role === "geometric" ? field : name), "rank", "mark"]
  const lines = [...rows].map((i) => [text(data.labels[i]), ...cells.map((cell) => cell(i)),
    ranking.rank[i] < 0 ? "" : ranking.rank[i], markOf(data, ranking, i)].join(","))
  const head = JSON.stringify(named(data.head)).replace(/"(?:[^"\\]|\\.)*"/g, (name) =>
    name.replace(/[,;]/g, (mark) => (mark === "," ? "\\u002c" : "\\u003b")))
  return `# ${head}\n${header.map((name) => quoted(inert(name))).join(",")}\n${lines.join("\n")}\n`
}

// The decision as a formulation in JSON, for people, the page and the commands (table's Formulation);
// what only the page knows stands under "page".
function decisionFile(data, state, ranking, verdict, date) {
  const row = state.chosen !== null ? data.rowOf.get(state.chosen) : verdict?.row ?? null
  const {limits, reason, chosen: _, ...view} = state
  const valueOf = ({texts, values}) => texts ? texts[values[row]] : Number.isFinite(values[row]) ? values[row] : null
  return `${JSON.stringify({
    ...data.opens_with,
    limits,
    chosen: row === null ? null : data.names[row],
    reason,
    page: {
      title: data.title,
      date,
      units: byName(data.objectives.filter(({unit}) => unit).map(({name, unit}) => [name, unit])),
      values: row === null ? {} : byName(data.columns.filter(({role}) => role !== "geometric")
        .map((column) => [column.name, valueOf(column)])),
      left: ranking.count,
      optimum: verdict === null ? null : data.names[verdict.row],
      verdict: verdict?.sentences ?? [],
      state: view,
    },
  }, null, 1)}\n`
}

// The state that the page opens with.
const initial = (data) => decided(data, data.opens_with)

// The state that a decision file holds, or null if it is about something else.
function opened(data, text) {
  let content = null
  try {
    content = text.length <= LONGEST_STATE * 16 ? JSON.parse(text) : null
  } catch { /* reported below */ }
  const {objectives, maximize, normalize, page} = isObject(content) ? content : {}
  const own = data.opens_with
  const same = (list, names) => Array.isArray(list) && JSON.stringify([...list].sort()) === JSON.stringify([...names].sort())
  const unlike = data.objectives.find(({name, unit}) => unit && (entryOf(page?.units, name) ?? unit) !== unit)
  const refused = !isObject(page) ? "it is no decision that a page has saved"
    : !same(objectives, own.objectives) ? "it has other objectives"
    : !same(maximize, own.maximize) ? "it maximises other objectives"
    : unlike ? `its unit of ${unlike.name} differs`
    : normalize !== data.normalize ? "it measures distances differently (normalize)" : ""
  return refused ? {state: null, remarks: [`The file is not opened: ${refused}.`]} : decided(data, content)
}

// The state of a formulation, and what a reader must know of it.
function decided(data, {limits, chosen, reason, page: {values, state: view}}) {
  const {state, remarks} = checked(data, {...view, limits, chosen, reason})
  const row = data.rowOf.get(state.chosen)
  const changes = data.objectives.filter((column) => row !== undefined && isObject(values) &&
    entryOf(values, column.name) !== column.values[row])
  if (changes.length) {
    remarks.unshift(`${capital(state.chosen)} has changed since then in ${listed(changes.map(({name}) => name))}.`)
  }
  return {state, remarks}
}

return {
  decode, initial, checked, toHash, fromHash, values, left, ranked, order, preference,
  verdict, explain, compared, compare, stretched, cautions, typed, written, short, csv,
  decisionFile, opened, MOST_PINS,
}
})()

if (typeof module !== "undefined") module.exports = Logic
