// Places by the distance to the ideal point (pareto's rank_of_efficiency).

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
// (pareto's UtopianFrame). Lengths are infinite where the range is none, sizes how large the values are
// in the scale.
function frameOf(F, front, normalize, fixed) {
  const low = F.map((column) => endOf(column, 1, front))
  const high = F.map((column) => endOf(column, -1, front))
  const {ideal, nadir} = fixed ?? {ideal: low, nadir: high}
  const lengths = ideal.map((best, j) => {
    const length = nadir[j] - best
    return length > NOISE * max(abs(best), abs(nadir[j])) ? length : Infinity
  })
  const scale = normalize ? lengths : lengths.map(() => 1)
  const sizes = lengths.map((length, j) => length === Infinity ? 0
    : max(...[low, high, ideal, nadir].map((point) => abs(point[j]))) / scale[j])
  return {low, high, ideal, nadir, lengths, scale, sizes}
}

// The distances of some rows to U, μ1, by row; NaN elsewhere. A value better than a fixed U counts as U.
function distances(F, {ideal, scale}, rows) {
  const away = new Float64Array(F[0].length).fill(NaN)
  for (const row of rows) {
    let square = 0
    for (let j = 0; j < F.length; j++) square += max((F[j][row] - ideal[j]) / scale[j], 0) ** 2
    away[row] = sqrt(square)
  }
  return away
}

// The ranking of the rows left (pareto's rank_of_efficiency), with the points U and N of another
// frame if one is given; from a former ranking, of other limits, it takes less time.
//   mask, rows, count     what was ranked, without prototypes
//   front, byPlace        the Pareto-optimal rows, and these by place
//   pareto, place         by row; only Pareto-optimal rows have a place, others have 0
//   mu1                   the distance to the ideal point by row, of prototypes too
//   ideal, nadir          in the original direction
//   best                  the rows of the Salukvadze optimum, which have place 1
//   frame                 the points U and N
function ranked(mask, fixed = null, former = null) {
  const {n, total, F} = data
  const rows = picked(data.designs, (i) => mask[i])
  const pareto = new Uint8Array(total)
  const front = rows.length ? frontOf(mask, rows, former) : rows
  const frame = frameOf(F, front, data.normalize, fixed)
  const mu1 = distances(F, frame, rows.length ? joined(rows, data.prototypes) : rows)
  for (const row of front) pareto[row] = 1
  const noise = LAST_PLACES * hypot(...frame.sizes)
  const best = [...leastOf(front, mu1, noise)]
  const turned = (point) => point.map((value, j) => (data.objectives[j].maximize ? -value : value) + 0)
  let places // found when they are asked for: sorting takes long, and what decides needs the best only
  const found = () => places ??= placesOf(front, mu1, noise)
  return {mask, rows, count: rows.length, front, pareto, mu1,
    ideal: turned(frame.ideal), nadir: turned(frame.nadir), best, frame, fixed,
    get byPlace() { return found().byPlace }, get place() { return found().place }}
}

// The places of the Pareto-optimal rows, by row: 1 and the number of those that are nearer to the
// ideal; rows that are equally near, up to rounding, share one. And the rows in this order.
function placesOf(front, mu1, noise) {
  const byPlace = argsort(mu1, front)
  const place = new Int32Array(mu1.length)
  let from = 0
  let reach = -Infinity
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
