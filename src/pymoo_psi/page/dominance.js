// Which designs no other dominates.

// The rows that no row left dominates, in ascending order. What is Pareto optimal among all is so
// among fewer; what is dominated stays so as long as the dominator found last is left, and what was
// optimal in the last call is compared only with rows that have come back since. What has a dominator
// left need not be compared with: this one dominates the same rows.
function frontOf(mask, rows) {
  const {optimal, dominator, last} = data
  if (rows.length === data.n) return picked(rows, (i) => optimal[i])
  const front = new Uint8Array(data.n) // at first all that may be on it
  const added = new Uint8Array(data.n) // of these
  for (const i of rows) {
    front[i] = optimal[i] || dominator[i] < 0 || !mask[dominator[i]] ? 1 : 0
    added[i] = front[i] && last && !last.mask[i] ? 1 : 0
  }
  const more = added.includes(1)
  for (const i of rows) {
    if (!front[i] || optimal[i]) continue
    const stays = last?.front[i]
    dominator[i] = stays && !more ? -1 : dominatorAmong(i, stays ? added : front, front)
    if (dominator[i] >= 0) front[i] = 0
  }
  data.last = {mask, front}
  return picked(rows, (i) => front[i])
}

// Find what dominates each design, one at a time, before a limit asks for all of them at once.
function* prepare() {
  const all = new Uint8Array(data.n).fill(1)
  for (let i = 0; i < all.length; i++) {
    if (data.optimal[i] || data.dominator[i] >= 0) continue
    data.dominator[i] = dominatorAmong(i, all)
    yield
  }
}

// One of the rows among a mask that dominates a row; -1 if there is none. All of them are within
// another mask, to which the boxes are fitted.
function dominatorAmong(i, among, within = among) {
  const boxes = data.boxes ??= boxesOf(data.F, data.designs)
  if (boxes.within !== within) fit(boxes, within)
  boxes.within = within
  return dominatorOf(boxes, Float64Array.from(data.F, (column) => column[i]), among)
}

// The rows in a tree of boxes, each with its least values, which `fit` finds, and two halves, of the
// higher and the lower values of an objective; those of at most 32 rows have these and their
// objectives, row by row.
function boxesOf(F, rows, depth = 0) {
  const column = F[depth % F.length]
  const few = Float64Array.from({length: 15}, (_, k) => column[rows[floor(k * rows.length / 15)]])
  const middle = few.sort()[7]
  const lower = picked(rows, (i) => rows.length > 32 && column[i] < middle)
  // Equal in this objective: perhaps not in another.
  if (!lower.length && rows.length > 32 && depth < 50) return boxesOf(F, rows, depth + 1)
  // The higher ones first: a dominator that is near is likely to have similar variables, and to stay.
  const parts = lower.length ? [picked(rows, (i) => !(column[i] < middle)), lower] : []
  const own = lower.length ? rows.subarray(0, 0) : rows
  const points = new Float64Array(own.length * F.length)
  F.forEach((values, j) => own.forEach((row, k) => { points[k * F.length + j] = values[row] }))
  return {low: new Float64Array(F.length), rows: own, points, halves: parts.map((half) => boxesOf(F, half, depth + 1))}
}

// The least values of the rows within a mask; where there are none nothing is searched for.
function fit({low, rows, points, halves}, within) {
  const m = low.length
  low.fill(Infinity)
  for (let k = 0; k < rows.length; k++) {
    if (within[rows[k]]) for (let j = 0; j < m; j++) if (points[k * m + j] < low[j]) low[j] = points[k * m + j]
  }
  for (const half of halves) {
    fit(half, within)
    for (let j = 0; j < m; j++) if (half.low[j] < low[j]) low[j] = half.low[j]
  }
}

// What dominates a point lies in boxes whose least values are nowhere worse.
function dominatorOf({low, rows, points, halves}, point, among) {
  const m = point.length
  for (let j = 0; j < m; j++) if (low[j] > point[j]) return -1
  for (let k = 0; k < rows.length; k++) {
    if (!among[rows[k]]) continue
    let j = 0
    let better = false
    for (; j < m && points[k * m + j] <= point[j]; j++) better ||= points[k * m + j] < point[j]
    if (j === m && better) return rows[k]
  }
  for (const half of halves) {
    const found = dominatorOf(half, point, among)
    if (found >= 0) return found
  }
  return -1
}
