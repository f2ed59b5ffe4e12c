// Axes: from values to places on them, and back.

// The share of the way from the low to the high end; what lies beyond an end is drawn there, or just
// outside of it.
function shareOn({low, high, log}, out = 0.02) {
  const [a, b] = log ? [Math.log(low), Math.log(high)] : [low, high]
  return (value) => {
    const share = b > a ? ((log ? Math.log(max(value, low * 0.5)) : value) - a) / (b - a) : 0.5 + Math.sign(value - low)
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
function ticks({low, high, log}, most) {
  if (!(high > low)) return [low]
  if (log && high / low >= 100) {
    const first = ceil(log10(low) - 1e-9)
    const last = floor(log10(high) + 1e-9)
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

// Ticks with their texts, which have as many digits as tell the values apart.
function tickTexts(scale, most) {
  const values = ticks(scale, most)
  const digits = values.length > 1 ? 12 : 6 // all that a tick has; a single one is any number
  const behind = max(...values.map((value) => String(Number(value.toPrecision(digits))).split(/[.e]/)[1]?.length ?? 0))
  const size = max(abs(scale.low), abs(scale.high))
  const hasPowers = size >= 1e6 || size < 1e-3
  return values.map((value) => {
    const significant = {maximumSignificantDigits: digits}
    const format = hasPowers ? powerOfTen(significant) : scale.log ? significant : decimals(behind)
    return {value, text: rounded(value, format).replaceAll("-", "−")}
  })
}
