// Elements of the page. Texts of the user's (names, units, labels, reasons) become text nodes or
// values, never markup.

const $ = (id) => document.getElementById(id)
const onClicks = (actions) => { for (const [id, action] of entriesOf(actions)) $(id).onclick = action }
const copyOf = (id) => $(id).content.firstElementChild.cloneNode(true) // of a template
const toggled = (list, item) => list.includes(item) ? list.filter((one) => one !== item) : [...list, item]
const show = (id, on) => { $(id).hidden = !on }

// Children are elements, texts, lists of them, and nothing where a condition does not hold.
const childrenOf = (children) => children.flat().filter(Boolean)

// An element of "tag.class" with properties, if any, and children.
function make(tag, ...children) {
  const [name, ...classes] = tag.split(".")
  const properties = children[0]?.constructor === Object ? children.shift() : {}
  const element = document.createElement(name)
  if (classes.length) element.className = classes.join(" ")
  Object.assign(element, properties)
  element.append(...childrenOf(children))
  return element
}
const makeAll = (tag, texts) => texts.map((text) => make(tag, text))
const head = (scope, ...children) => make("th", {scope}, ...children)
const button = (text, onclick, properties = {}) => make("button.small", {onclick, ...properties}, text)

// Make the children of an element, or of that of an id, like others. What stays is neither laid out
// nor announced again, and keeps the focus.
function renew(place, ...children) {
  const element = typeof place === "string" ? $(place) : place
  const nodes = childrenOf(children)
  nodes.forEach((child, k) => {
    const node = typeof child === "string" ? new Text(child) : child
    const old = element.childNodes[k]
    if (!old) element.append(node)
    else if (old.nodeName !== node.nodeName) old.replaceWith(node)
    else if (old.nodeType !== Node.TEXT_NODE) renewElement(old, node)
    else if (old.data !== node.data) old.data = node.data
  })
  while (element.childNodes.length > nodes.length) element.lastChild.remove()
}
function renewElement(old, node) {
  for (const {name, value} of node.attributes) if (old.getAttribute(name) !== value) old.setAttribute(name, value)
  for (const name of old.getAttributeNames()) if (!node.hasAttribute(name)) old.removeAttribute(name)
  Object.assign(old, {onclick: node.onclick, look: node.look})
  renew(old, ...node.childNodes)
}

// A number and the word behind it, its unit perhaps, stay on one line, as does a unit with "higher".
const tied = (text) => text.replace(/(?<=\d) | (?=higher|lower)/g, "\u00a0")
const upper = (text) => text.replace(/^./, (first) => first.toUpperCase())

function say(sentences) {
  const close = sentences.length && button("Close", () => say([]))
  $("messages").replaceChildren(...childrenOf([close, makeAll("p", sentences)])) // announced again
}

// A field for a number; `accept` returns what is wrong with it, or "". What is wrong stays to be mended.
function numberField(input, name, accept) {
  input.ariaLabel = name
  input.onchange = () => {
    const {value, wrong} = typed(input.value)
    input.setCustomValidity(wrong ?? accept(value))
    input.reportValidity()
  }
}
// What is being typed stays as long as the number is the same.
function showNumber(input, value) {
  const text = value === null ? "" : exact(value)
  if (text !== input.defaultValue) showText(input, text)
}
function showText(input, text) {
  input.value = input.defaultValue = text
  input.setCustomValidity("")
}

// Do what a key stands for, unless it is pressed with another one.
function onKeys(element, actions) {
  element.onkeydown = (event) => {
    const action = !event.ctrlKey && !event.metaKey && !event.altKey && actions[event.key.toLowerCase()]
    if (!action) return
    event.preventDefault()
    event.stopPropagation()
    action()
  }
}

function download(content, name, note = "") {
  const link = make("a", {href: URL.createObjectURL(content), download: name})
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10000)
  say([`Saved as ${name}.${note}`])
}

// Copy a part of the page as a picture; where that is forbidden, save it.
function copyPicture(id, name) {
  picture($(id)).toBlob(async (blob) => {
    try {
      await navigator.clipboard.write([new ClipboardItem({"image/png": blob})])
      say(["The picture is in the clipboard."])
    } catch {
      download(blob, `${data.file}-${name}.png`)
    }
  })
}
