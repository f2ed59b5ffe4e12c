// Where names of designs stand in a plot: beside their points or, with a line to them, farther away.
//
// A box has x, y, width and height, and the row that it is of. A point has its centre u, v beside the box
// around it that names of others keep clear, so that one sees whose a name is.

const SIDES = [[1, 0], [-1, 0], ...[0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1, -1].flatMap((across) => [[across, -1], [across, 1]])] // of a point, where its name may be
const GAP = 6 // pixels between names, which are not to be read as one
const AWAY = [5, 17, 29, 43, 59] // from the shape of a point, the first without a line
const WIDEST = [0.6, 0.35] // share of the plot that a name may take; with the smaller one it has more lines
const UNPLACED = 9 // more than all faults of a place

const isFree = (box, others) => !others.some((one) => one.row !== box.row && box.x < one.x + one.width + GAP && one.x < box.x + box.width + GAP &&
  box.y < one.y + one.height && one.y < box.y + box.height)

// How far it is across and down from a point to the text of a name, which is three pixels inside of its box.
const wayTo = ({x, y, width, height}, {u, v}) => [min(max(0, x - u), x + width - u), min(max(0, y + 3 - v), y + height - 3 - v)]

// The places of a name, beside its point first, with the spots of a line to it.
function* placesAround(g, {row, u, v}, radius, text, {left, right, top, bottom}) {
  for (const share of WIDEST) {
    const words = wrapped(g, text, (right - left) * share)
    const width = max(...words.map((line) => g.measureText(line).width))
    const height = 14 * words.length
    for (const gap of AWAY) for (const [across, down] of SIDES) {
      const reach = gap + radius
      const box = {row, words, font: g.font, width, height, tie: [],
        x: u + across * reach + (across - 1) / 2 * width, y: v + down * (reach + 2) + (down - 1) / 2 * height}
      if (box.x <= left || box.x + width >= right || box.y < top || box.y + height >= bottom) continue
      const [dx, dy] = wayTo(box, {u, v})
      for (let way = 6 / hypot(dx, dy); gap > AWAY[0] && way < 1; way += 0.1) {
        box.tie.push({row, x: u + way * dx, y: v + way * dy, width: 0, height: 0})
      }
      yield box
    }
  }
}

// What is wrong with a place: it is nearer to another point, on one, or on a line; the first two only with a line
// to its own point.
function faultOf(place, {point, hatched}, {points, lines}, taken, least) {
  const covers = (others, start = 0) => [place, ...place.tie.slice(start)].some((spot) => !isFree(spot, others))
  if (covers(taken) || !isFree(place, hatched)) return UNPLACED
  const own = hypot(...wayTo(place, point))
  const isStray = points.some((one) => hypot(...wayTo(place, one)) < own)
  const fault = 4 * isStray + 2 * covers(points)
  if (fault >= least || (fault && !place.tie.length)) return UNPLACED
  return fault + covers(lines, 3) // near its point a line may be on that of the front
}

// The best place of a name, by the first of its texts that has one.
function bestPlace(g, name, room, taken) {
  g.font = name.font
  let best = {fault: UNPLACED}
  for (const text of name.texts) for (const place of best.tie ? [] : placesAround(g, name.point, name.radius, text, room)) {
    const least = min(name.most, best.fault)
    const fault = faultOf(place, name, room, taken, least)
    if (fault < least) best = {...place, fault}
    if (!fault) return best
  }
  return best
}

// The places of names, none on another. What finds none, or has a fault, comes first in another try.
//   names   point, radius of its shape, font, texts of which the first is preferred, most (all faults are less), and
//           hatched: boxes to avoid
//   room    points and lines, and left, right, top, bottom
function placedNames(g, names, room, tries) {
  let best = []
  let least = Infinity
  for (; tries > 0 && least > 0; tries--) {
    const taken = [] // by names and their lines
    const placed = names.map((name) => {
      const place = bestPlace(g, name, room, taken)
      if (place.tie) taken.push(place, ...place.tie)
      return {name, place}
    }).sort((a, b) => b.place.fault - a.place.fault)
    const faults = sum(placed.map(({place}) => place.fault))
    if (faults < least) {
      best = placed.map(({place}) => place).filter(({tie}) => tie)
      least = faults
    }
    names = placed.map(({name}) => name)
  }
  return best
}
