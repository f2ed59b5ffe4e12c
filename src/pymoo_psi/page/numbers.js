// Numbers as texts and texts as numbers, as Python writes and reads them.
const isNumber = Number.isFinite
const entriesOf = Object.entries
const {abs, ceil, floor, hypot, log10, max, min, round, sqrt} = Math

// A number rounded as Python rounds it: by all of its digits, an exact half to the even one. From five
// digits on thousands are apart.
const formats = {} // making one takes long
function rounded(value, options) {
  const format = formats[JSON.stringify(options)] ??=
    new Intl.NumberFormat("en", {roundingMode: "halfEven", signDisplay: "negative", useGrouping: "min2", ...options})
  return localized(format.format(value.toPrecision(60))).replace("E", "e")
}
const localized = (text) => text.replaceAll(",", "\u00a0").replace(".", data.decimal)

const decimals = (count) => ({minimumFractionDigits: count, maximumFractionDigits: count})
const powerOfTen = (options) => ({...options, notation: "scientific"})

// A number with all of its digits.
const exact = (value) => localized(String(value).replace(/^-?\d{5,}/, (whole) => whole.replace(/\B(?=(\d{3})+$)/g, ",")))

// A number with a few digits, none lost before the point, and at least so many decimals.
function short(value, digits = 4, least = 0) {
  if (!isNumber(value)) return String(value).replace("Infinity", "inf")
  const size = abs(value)
  const isLong = size >= 1e7 - 0.5
  if (!isLong && (size >= 10 ** digits - 0.5 || Number.isInteger(value))) return rounded(value, decimals(least))
  const significant = {maximumSignificantDigits: digits}
  const near = Number(size.toPrecision(digits))
  if (near >= 10 ** digits || near < 1e-4) return rounded(value, powerOfTen(significant))
  const text = rounded(value, significant)
  const count = text.split(data.decimal)[1]?.length ?? 0
  return count < least ? rounded(value, decimals(least)) : text
}

// The decimals of the values of the rows that no other dominates, 0 if some has more than three.
function decimalsOf(column, ranking) {
  const {front} = ranking
  const {name, values} = column
  const known = ranking.decimals ??= Object.create(null) // of any names
  const areAsGiven = (count) => {
    const factor = 10 ** count
    return front.every((row) => {
      const value = values[row]
      return !isNumber(value) || abs(value - round(value * factor) / factor) <= 1e-12 * abs(value)
    })
  }
  return known[name] ??= [0, 1, 2, 3].find(areAsGiven) ?? 0
}

// A share with two digits, above 10 % with none behind the point.
function percent(share) {
  const hundreds = 100 * share
  if (hundreds > 0 && hundreds < 0.01) return localized("less than 0.01 %")
  if (hundreds >= 99.95 && hundreds < 100 - 1e-7) return localized("more than 99.9 %")
  if (hundreds >= 99.5 && hundreds < 99.95) return `${short(hundreds, 3)} %`
  if (!(hundreds >= 9.95) || hundreds === Infinity) return `${short(hundreds, 2)} %`
  return `${rounded(hundreds, {...decimals(0), useGrouping: false})} %`
}

// Shares of one whole as whole per cents that add up to 100: those with the largest remainders are
// rounded up, and shares below 1 % are only said to be so.
function percents(shares) {
  const hundreds = shares.map((share) => 100 * share)
  const whole = hundreds.map(floor)
  const remainders = hundreds.map((value, k) => (value >= 1 ? round((value - whole[k]) * 1e9) / 1e9 : 0))
  for (const k of bySize(remainders).slice(0, round(sum(remainders)))) whole[k]++
  return hundreds.map((value, k) => {
    if (value > 0 && value < 1) return "less than 1 %"
    return whole[k] === 100 && value < 100 - 1e-7 ? "more than 99 %" : `${whole[k]} %`
  })
}

// A number with the digits that tell designs of its column apart; a text is itself.
function written({texts, notation}, value) {
  if (texts) return texts[value] || "–"
  if (value !== value) return "–"
  if (!isNumber(value)) return value > 0 ? "∞" : "−∞"
  let format = decimals(notation.decimals)
  // Values beyond the range of the column, penalties perhaps, have no place in its notation.
  if (notation.powers) format = value === 0 ? decimals(0) : powerOfTen(format)
  else if (abs(value) >= 1e7) format = powerOfTen(decimals(3))
  return rounded(value, format).replaceAll("-", "−")
}

// A difference of values in their unit; of per cent it is points.
const amount = (column, value, ranking) => withUnit({unit: column.unit === "%" ? "points" : column.unit}, short(value, 3, decimalsOf(column, ranking)))
const withUnit = ({unit}, text) => (unit ? `${text} ${unit}` : text)

// A number of up to three decimals as text, without the rounding of a calculation; "" for others.
function shortText(value) {
  const text = String(Number(value.toPrecision(15)))
  return /^-?(?=[\d.]{1,13}$)\d{1,12}(\.\d{1,3})?$/.test(text) ? text : ""
}

// A value rounded up or down to six digits, or more, until none of others is as near; and the digits.
// One of up to three decimals has all its digits, others have all of those before the point.
function inDigits(value, others, isUp) {
  const before = abs(value) < 1e7 ? String(floor(abs(value))).length : 0
  const least = max(6, before, shortText(value).replace(/^[-0.]+|\./g, "").length)
  for (let digits = least; digits < 17; digits++) {
    const options = {maximumSignificantDigits: digits, useGrouping: false, roundingMode: isUp ? "ceil" : "floor"}
    const near = Number(new Intl.NumberFormat("en", options).format(value))
    if (!others.some((other) => other !== value && abs(other - value) <= abs(near - value))) return [near, digits]
  }
  return [value, 17]
}

// A number as a reader typed it: {value}, which is null for nothing, or {wrong}, what to type instead.
// Points and commas are decimal marks, but where they, or spaces, separate thousands.
const THOUSANDS = /^([+-]?[1-9]\d{0,2}([.,\s])\d{3}(?:\2\d{3})*)((?!\2)[.,]\d*)?$/
function typed(text) {
  let plain = text.trim().replace(/[−–]/g, "-")
  const [, whole, gap, fraction = ""] = plain.match(THOUSANDS) ?? []
  if (gap && (fraction || gap !== data.decimal)) {
    const joined = whole.replaceAll(gap, "")
    if (/[.,]/.test(gap) && !fraction && whole.split(gap).length === 2) {
      return {wrong: `${whole.replace(gap, data.decimal)} or ${joined}? Enter one of them.`}
    }
    plain = joined + fraction
  }
  if (plain === "") return {value: null}
  const value = Number(plain.replace(",", "."))
  if (!isNumber(value) || /[box]/i.test(plain)) return {wrong: "Enter a number such as 1.5 or 2e3."}
  return {value}
}
