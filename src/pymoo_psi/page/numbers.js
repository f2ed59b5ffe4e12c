// Numbers as texts and texts as numbers, as Python writes and reads them.
const isNumber = Number.isFinite
const entriesOf = Object.entries
const {abs, ceil, floor, hypot, log10, max, min, round, sqrt} = Math

let decimalMark = "." // as in the source
const useMark = (mark) => { decimalMark = mark }

// The digits of a number as Python rounds them, an exact half to the even digit: 62.5 -> 6.2e+1.
function roundedText(value, digits) {
  const up = value.toExponential(digits - 1) // an exact half is rounded up
  if (!value.toExponential(digits).includes("5e")) return up // all digits take long
  const [mantissa, exponent] = abs(value).toExponential(60).split("e")
  const all = mantissa.replace(".", "")
  const half = all[digits] === "5" && /^0*$/.test(all.slice(digits + 1))
  if (!half || Number(all[digits - 1]) % 2) return up
  return `${value < 0 ? "-" : ""}${all[0]}.${all.slice(1, digits)}e${exponent}`
}

// A positive number as a whole one; an exact half goes to the even number.
function evenWhole(size) {
  const down = floor(size)
  return size - down === 0.5 ? down + down % 2 : round(size)
}

// A number with a few digits, none lost before the point; from five on thousands are apart, as in Python.
function short(value, digits = 4) {
  if (value === 0 || !isNumber(value)) return String(value).replace("Infinity", "inf")
  const size = abs(value)
  if (size < 1e7 - 0.5 && (size >= 10 ** digits - 0.5 || Number.isInteger(value))) {
    return (value < 0 ? "-" : "") + apart(String(evenWhole(size)))
  }
  const text = roundedText(value, digits)
  const [mantissa, power] = text.split("e").map(Number)
  if (power >= -4 && power < digits) {
    return apart(localized(Number(text).toFixed(max(0, digits - 1 - power)).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "")))
  }
  return `${localized(String(mantissa))}e${power}`
}
const localized = (text) => text.replace(".", decimalMark)
const apart = (text) => text.replace(/^-?\d{5,}/, (whole) => whole.replace(/\B(?=(\d{3})+$)/g, "\u00a0"))

// A share with two digits, above 10 % with none behind the point.
function percent(share) {
  const hundreds = 100 * share
  if (hundreds > 0 && hundreds < 0.01) return localized("less than 0.01 %")
  if (hundreds >= 99.95 && hundreds < 100 - 1e-7) return localized("more than 99.9 %")
  if (hundreds >= 99.5 && hundreds < 99.95) return `${localized(roundedText(hundreds, 3).replace(/^(.)\.(.)(.).*/, "$1$2.$3"))} %`
  if (!(hundreds >= 9.95) || hundreds === Infinity) return `${short(hundreds, 2)} %`
  return `${BigInt(evenWhole(hundreds))} %` // all digits of any
}

// A number with the digits that tell designs of its column apart; a text is itself.
function written({texts, notation}, value) {
  if (texts) return texts[value] || "–"
  if (value === null || Number.isNaN(value)) return "–"
  if (!isNumber(value)) return value > 0 ? "∞" : "−∞"
  return localized(withDigits(notation, value)).replaceAll("-", "−")
}

function withDigits({decimals, powers}, value) {
  // Values beyond the range of the column, penalties perhaps, have no place in its notation.
  if (powers || abs(value) >= 1e7) return value === 0 ? "0" : roundedText(value, 1 + (powers ? decimals : 3)).replace("+", "")
  const significant = decimals + 1 + floor(log10(abs(value)))
  const even = significant > 0 ? Number(roundedText(value, significant)) : value // toFixed rounds a half up
  return apart(even.toFixed(decimals).replace(/^-(?=[0.]*$)/, "")) // no -0
}

// A difference of values in their unit; of per cent it is points.
const amount = ({unit}, value) => short(value, 3) + (unit === "%" ? " points" : unit ? ` ${unit}` : "")

// A value with six digits, rounded up or down.
function inSixDigits(value, isUp) {
  if (value === 0 || !isNumber(value)) return value
  const near = Number(value.toPrecision(6))
  if (isUp ? near >= value : near <= value) return near
  return Number((near + (isUp ? 1 : -1) * 10 ** (floor(log10(abs(value))) - 5)).toPrecision(6))
}

// A number as a reader typed it: {value}, which is null for nothing, or {wrong}, what to type instead.
// Points and commas are decimal marks, but where one that is not the page's may separate thousands, as
// spaces do.
function typed(text) {
  const other = decimalMark === "." ? "," : "."
  const plain = text.trim().replace(/[−–]/g, "-").replace(/(?<=^[+-]?\d[\d\s]*)\s(?=\d{3}(?!\d))/g, "")
    .replace(/^[+-]?[1-9]\d{0,2}(([.,])\d{3})+(?!\2)[.,]\d*$/, (number, _, gap) => number.replaceAll(gap, ""))
  if (plain === "") return {value: null}
  if (!/^[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?$/i.test(plain)) return {wrong: "Enter a number such as 1.5 or 2e3."}
  if (new RegExp(`^[+-]?[1-9]\\d{0,2}\\${other}\\d{3}$`).test(plain)) {
    return {wrong: `${plain.replace(other, decimalMark)} or ${plain.replace(other, "")}? Enter one of them.`}
  }
  const value = Number(plain.replace(",", "."))
  return isNumber(value) ? {value} : {wrong: "Enter a number below 1e308."}
}
