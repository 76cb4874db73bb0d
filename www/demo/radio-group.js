// Radio groups of buttons, as the ARIA practices have them: one stop for Tab, and arrow keys that choose.

/** By how many buttons each key goes on. @type {Readonly<Record<string, number>>} */
const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

/**
 * @param {Element} group
 * @param {string} name of the data attribute
 * @param {string | null} value of the button that is chosen
 */
export function check(group, name, value) {
  const buttons = [...group.querySelectorAll("button")];
  const chosen = buttons.find(({ dataset }) => dataset[name] === value);
  for (const button of buttons) {
    button.setAttribute("aria-checked", String(button === chosen));
    button.tabIndex = button === (chosen ?? buttons[0]) ? 0 : -1;
  }
}

addEventListener("keydown", (event) => {
  const button = event.target instanceof Element && event.target.closest('[role="radio"]');
  const step = STEPS[event.key];
  if (!button || !step || event.altKey || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  const others = [...(button.parentElement?.querySelectorAll("button") ?? [])].filter(({ hidden }) => !hidden);
  const next = others.at((others.findIndex((other) => other === button) + step) % others.length);
  next?.focus();
  next?.click();
});
