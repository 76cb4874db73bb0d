// The parts of the page, by their selectors.

/**
 * @template {Element} [T=HTMLElement]
 * @param {string} selector
 * @param {new () => T} [kind] what it has to be
 * @throws where the page has none
 */
export function part(selector, kind = /** @type {any} */ (HTMLElement)) {
  const found = document.querySelector(selector);
  if (!(found instanceof kind)) throw new Error(`The page has no ${selector}.`);
  return found;
}
