// Which designs no other dominates.

// The rows that no row left dominates, in ascending order. What is Pareto optimal among all is so
// among fewer; what is dominated stays so as long as the dominator found last is left, and what was
// optimal in the last call is compared only with rows that have come back since.
function frontOf(mask, rows) {
  const {optimal, dominator, last} = data
  if (rows.length === data.n) return picked(rows, (i) => optimal[i])
  const added = new Uint8Array(data.n)
  let more = 0
  if (last) for (let i = 0; i < data.n; i++) more += added[i] = mask[i] & ~last.mask[i]
  const front = new Uint8Array(data.n)
  for (const i of rows) {
    if (!optimal[i] && (dominator[i] < 0 || !mask[dominator[i]])) {
      const stays = last?.front[i]
      dominator[i] = stays && !more ? -1 : dominatorAmong(i, stays ? added : mask)
    }
    front[i] = optimal[i] || dominator[i] < 0 ? 1 : 0
  }
  data.last = {mask: mask.slice(), front}
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

// One of the rows among a mask that dominates a row; -1 if there is none.
function dominatorAmong(i, among) {
  data.boxes ??= boxesOf(data.F, data.designs)
  return dominatorOf(data.boxes, Float64Array.from(data.F, (column) => column[i]), among)
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

// What dominates a point lies in boxes whose least values are nowhere worse.
function dominatorOf({low, rows, points, halves}, point, among) {
  const m = point.length
  for (let j = 0; j < m; j++) if (low[j] > point[j]) return -1
  for (let k = 0; k < rows.length; k++) {
    if (!among[rows[k]]) continue
    let [j, better] = [0, false]
    for (; j < m && points[k * m + j] <= point[j]; j++) better ||= points[k * m + j] < point[j]
    if (j === m && better) return rows[k]
  }
  for (const half of halves) {
    const found = dominatorOf(half, point, among)
    if (found >= 0) return found
  }
  return -1
}
