// Typed arrays by loops, as the methods of arrays take several times as long.
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
  for (const row of rows) if (accepts(row)) room[count++] = row
  return room.slice(0, count)
}

// The rows whose values are the least, but for a tolerance.
function leastOf(rows, values, tolerance) {
  const reach = endOf(values, 1, rows) + tolerance
  return picked(rows, (row) => values[row] <= reach)
}

// The values of some rows; Float64Array.from takes ten times as long.
function gathered(values, rows, result = new Float64Array(rows.length)) {
  for (let k = 0; k < rows.length; k++) result[k] = values[rows[k]] + 0 // no -0
  return result
}

const unique = (items) => [...new Set(items)]
function joined(...lists) {
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
  for (const value of array) total += value
  return total
}
// The least of numbers (sign 1) or the greatest (-1), of all or of some rows; a loop, as reduce takes
// several times as long.
function endOf(array, sign, rows = null) {
  let end = Infinity
  const n = (rows ?? array).length
  for (let k = 0; k < n; k++) {
    const value = sign * array[rows ? rows[k] : k]
    if (value < end) end = value
  }
  return sign * end + 0 // no -0
}
const endsOf = (array, rows) => [1, -1].map((sign) => endOf(array, sign, rows))

// The rows in the order of their values, missing ones last; equal ones stay as they are. They are
// sorted by the leading bits of their numbers first, as a comparing function takes thirty times as
// long and then has next to nothing left to do.
function argsort(values, rows) {
  const n = rows.length
  const keys = gathered(values, rows)
  const words = new Int32Array(keys.buffer)
  const leading = new Uint32Array(n)
  for (let k = 0; k < n; k++) { // negative numbers are the lower, the larger their bits
    if (keys[k] !== keys[k]) keys[k] = Infinity
    leading[k] = words[2 * k + 1] < 0 ? ~words[2 * k + 1] : words[2 * k + 1] ^ 0x80000000
  }
  let order = upTo(n)
  for (const shift of [0, 11, 22]) {
    const ends = new Int32Array(2049)
    const next = new Int32Array(n)
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
  return gathered(rows, order, new Int32Array(n))
}
