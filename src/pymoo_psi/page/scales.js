// Axes: from values to places on them, and back.

// The share of the way from the low to the high end; what lies beyond an end is drawn there, or just
// outside of it.
function shareOn({low, high, log}, out = 0.02) {
  const [a, b] = log ? [Math.log(low), Math.log(high)] : [low, high]
  const length = b - a || 1
  return (value) => {
    const share = b > a ? ((log ? Math.log(max(value, low * 0.5)) : value) - a) / length : 0.5
    return share < -out ? -out : share > 1 + out ? 1 + out : share
  }
}

// Values to places between two ends.
function placing(scale, start, end, out) {
  const share = shareOn(scale, out)
  return (value) => start + share(value) * (end - start)
}

const valueAt = ({low, high, log}, share) =>
  log ? low * (high / low) ** share : low + (high - low) * share

// Steps of 1, 2 or 5 times a power of ten; on a log axis over decades powers of ten.
const isOverDecades = ({low, high, log}) => log && high / low >= 100
function ticks(scale, most) {
  const {low, high} = scale
  if (!(high > low)) return [low]
  if (isOverDecades(scale)) {
    const [first, last] = [ceil(log10(low) - 1e-9), floor(log10(high) + 1e-9)]
    const every = ceil((last - first + 1) / most)
    return Array.from({length: floor((last - first) / every) + 1}, (_, k) => 10 ** (first + k * every))
  }
  const rough = (high - low) / most
  const power = 10 ** floor(log10(rough))
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999)
  const first = ceil(low / step - 1e-9)
  const count = floor(high / step + 1e-9) - first
  if (count < 1 && most < 20) return ticks({low, high}, 2 * most) // a single number tells no distance
  // A product of integers and the power, so that 0.3 is not 0.30000000000000004.
  return Array.from({length: count + 1}, (_, k) => Number(((first + k) * step).toPrecision(12)))
}

const raised = (power) => [...String(power)].map((c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("")

// Ticks as texts, and the power of ten by which a name is followed: 1.2 with "×10⁶" reads better
// in a narrow column than 1200000.
function tickTexts(scale, most, texts) {
  if (texts) {
    const known = [...texts.keys()].filter((k) => k >= scale.low && k <= scale.high)
    const every = ceil(known.length / most)
    const values = known.filter((_, k) => k % every === 0)
    return {values, texts: values.map((k) => (texts[k].length > 18 ? `${texts[k].slice(0, 17)}…` : texts[k])), factor: ""}
  }
  const values = ticks(scale, most)
  if (isOverDecades(scale)) return {values, texts: values.map((value) => `10${raised(round(log10(value)))}`), factor: ""}
  const size = max(abs(scale.low), abs(scale.high))
  const power = size > 0 && (size >= 1e5 || size < 1e-2) ? 3 * floor(log10(size) / 3) : 0
  const digits = values.length > 1 ? 12 : 6 // all that a tick has; a single one is any number
  const numbers = values.map((value) => Number((value / 10 ** power).toPrecision(digits)))
  const behind = max(...numbers.map((number) => (String(number).split(".")[1] ?? "").length))
  return {
    values,
    texts: numbers.map((number) => rounded(number, decimals(behind)).replaceAll("-", "−")),
    factor: power ? `×10${raised(power)}` : "",
  }
}
