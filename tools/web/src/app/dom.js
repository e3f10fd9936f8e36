/** The few helpers that a page without a framework needs. */

/**
 * An element. Attributes that are functions become listeners (`onclick`), `class` and `data-*` are
 * attributes, everything else that the element knows is set as a property.
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name in element && !name.includes('-') && name !== 'list' && name !== 'form') element[name] = value;
    else element.setAttribute(name, value === true ? '' : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export function fill(element, ...children) {
  element.replaceChildren(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
}

/** Writes only what changed: a screen reader and a selection stay where they are. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function download(name, text, type = 'text/plain') {
  const address = URL.createObjectURL(new Blob([text], { type }));
  const link = h('a', { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

/** For a reader: as many digits as matter. */
export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 10 ** digits) return value.toFixed(0);
  if (size < 1e-3) return value.toExponential(2);
  return value.toPrecision(digits).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '');
}

/** Chosen layout and theme; never anything of a key. */
export const store = {
  get(name, otherwise) {
    try {
      return JSON.parse(localStorage.getItem(`zh-${name}`)) ?? otherwise;
    } catch {
      return otherwise;
    }
  },
  set(name, value) {
    try {
      localStorage.setItem(`zh-${name}`, JSON.stringify(value));
    } catch {
      // A page opened from a folder may have no storage.
    }
  },
};
