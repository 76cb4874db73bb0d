// Objects that tell what happens, by typed events.

/**
 * An EventTarget whose events hold something in their `detail`.
 *
 * @template {{ [Name in keyof Events]: CustomEvent }} Events by their names
 */
export class Announcer extends EventTarget {
  /**
   * @template {keyof Events & string} Name
   * @param {Name} name
   * @param {((event: Events[Name]) => void) | EventListenerObject | null} listener
   * @param {AddEventListenerOptions | boolean} [options]
   * @override
   */
  addEventListener(name, listener, options) {
    super.addEventListener(name, /** @type {EventListener | EventListenerObject | null} */ (listener), options);
  }

  /**
   * @template {keyof Events & string} Name
   * @param {Name} name
   * @param {Events[Name]["detail"]} detail
   * @protected
   */
  tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}
