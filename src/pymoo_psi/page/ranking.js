// Places by the distance to the ideal point (pareto's rank_of_efficiency).

const NOISE = 64 * Number.EPSILON // as in pareto, which has the reasons for this one and the next three
const LAST_PLACES = 8 * Number.EPSILON

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
  const all = rows.length ? joined(rows, data.prototypes) : rows
  const [mu, units] = frame.measured(F, all, total)
  for (let k = 0; k < front.length; k++) pareto[front[k]] = 1
  const [nearness, noise] = [mu[0].slice(), frame.noise(units[0])] // in the unit of μ1
  const reach = leastOf(nearness, front) + noise
  const best = [...picked(front, (i) => nearness[i] <= reach)]
  mu.forEach((column, k) => {
    for (let at = 0; at < all.length; at++) column[all[at]] *= units[k]
  })
  const turned = (point) => point.map((value, j) => (data.objectives[j].maximize ? -value : value) + 0)
  let places // found when they are asked for: sorting takes long, and what decides needs the best only
  const found = () => places ??= placesOf(front, nearness, noise)
  return {mask, rows, count: rows.length, front, pareto, mu1: mu[0], mu2: mu[1], mu3: mu[2],
    ideal: turned(frame.ideal), nadir: turned(frame.nadir), best, frame, fixed,
    get byPlace() { return found().byPlace }, get place() { return found().place }}
}

// The places of the Pareto-optimal rows, by row: 1 and the number of those that are nearer to the
// ideal; rows that are equally near, up to rounding, share one. And the rows in this order.
function placesOf(front, mu1, noise) {
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
