// Which designs no other dominates.

// The rows that no row left dominates, in ascending order. What is Pareto optimal among all is so
// among fewer; what is dominated stays so as long as the dominator found last is left, and what was
// optimal in a former ranking is compared only with rows that have come back since. What has a
// dominator left need not be compared with: this one dominates the same rows.
function frontOf(mask, rows, former) {
  const {optimal, dominator} = data
  if (rows.length === data.n) return picked(rows, (i) => optimal[i])
  const front = new Uint8Array(data.n) // at first all that may be on it
  const added = new Uint8Array(data.n) // of these
  for (const i of rows) {
    front[i] = optimal[i] || dominator[i] < 0 || !mask[dominator[i]] ? 1 : 0
    added[i] = front[i] && former && !former.mask[i] ? 1 : 0
  }
  const more = added.includes(1)
  let boxes = null
  for (const i of rows) {
    if (!front[i] || optimal[i]) continue
    const stays = former?.pareto[i]
    if (stays && !more) dominator[i] = -1
    else dominator[i] = dominatorOf(boxes ??= boxesWithin(front), pointOf(i), stays ? added : front)
    if (dominator[i] >= 0) front[i] = 0
  }
  return picked(rows, (i) => front[i])
}

// Find what dominates each design, one at a time, before a limit asks for all of them at once.
function* prepare() {
  const all = new Uint8Array(data.n).fill(1)
  const boxes = boxesWithin(all)
  for (let i = 0; i < all.length; i++) {
    if (data.optimal[i] || data.dominator[i] >= 0) continue
    data.dominator[i] = dominatorOf(boxes, pointOf(i), all)
    yield
    if (data.n > all.length) return // designs have come, among which limits will search
  }
}

const pointOf = (i) => Float64Array.from(data.F, (column) => column[i])
const boxesWithin = (mask) => fitted(data.boxes ??= boxesOf(data.F, data.designs), mask)

// The rows in a tree of boxes, as a list of them, the whole first. Each has two halves, of the higher and
// the lower values of an objective; those of at most 32 rows have these and their objectives, row by row.
function boxesOf(F, rows, boxes = [], depth = 0) {
  const column = F[depth % F.length]
  const few = Float64Array.from({length: 15}, (_, k) => column[rows[floor(k * rows.length / 15)]])
  const middle = few.sort()[7]
  const lower = picked(rows, (i) => rows.length > 32 && column[i] < middle)
  // Equal in this objective: perhaps not in another.
  if (!lower.length && rows.length > 32 && depth < 50) return boxesOf(F, rows, boxes, depth + 1)
  const own = lower.length ? rows.subarray(0, 0) : rows
  const points = new Float64Array(own.length * F.length)
  F.forEach((values, j) => own.forEach((row, k) => { points[k * F.length + j] = values[row] }))
  const halves = []
  boxes.push({rows: own, points, halves})
  if (!lower.length) return boxes
  // The higher ones first: a dominator that is near is likely to have similar variables, and to stay.
  for (const half of [picked(rows, (i) => !(column[i] < middle)), lower]) {
    halves.push(boxes.length)
    boxesOf(F, half, boxes, depth + 1)
  }
  return boxes
}

// Boxes with the least values of their rows within a mask; where there are none nothing is searched for.
function fitted(boxes, mask) {
  const m = data.F.length
  const low = new Float64Array(boxes.length * m).fill(Infinity)
  const lower = (at, value) => { if (value < low[at]) low[at] = value }
  for (let b = boxes.length - 1; b >= 0; b--) { // halves before the whole
    const {rows, points, halves} = boxes[b]
    for (let k = 0; k < rows.length; k++) {
      if (mask[rows[k]]) for (let j = 0; j < m; j++) lower(b * m + j, points[k * m + j])
    }
    for (const half of halves) for (let j = 0; j < m; j++) lower(b * m + j, low[half * m + j])
  }
  return {boxes, low}
}

// A row among a mask that dominates a point, -1 if there is none: it lies in boxes whose least values are
// nowhere worse.
function dominatorOf(fit, point, among, b = 0) {
  const m = point.length
  const {rows, points, halves} = fit.boxes[b]
  for (let j = 0; j < m; j++) if (fit.low[b * m + j] > point[j]) return -1
  for (let k = 0; k < rows.length; k++) {
    if (!among[rows[k]]) continue
    let j = 0
    let better = false
    for (; j < m && points[k * m + j] <= point[j]; j++) better ||= points[k * m + j] < point[j]
    if (j === m && better) return rows[k]
  }
  for (const half of halves) {
    const found = dominatorOf(fit, point, among, half)
    if (found >= 0) return found
  }
  return -1
}
