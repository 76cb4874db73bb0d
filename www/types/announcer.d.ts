/**
 * An EventTarget whose events hold something in their `detail`.
 *
 * @template {{ [Name in keyof Events]: CustomEvent }} Events by their names
 */
export declare class Announcer<Events extends {
    [Name in keyof Events]: CustomEvent;
}> extends EventTarget {
    /**
     * @template {keyof Events & string} Name
     * @param {Name} name
     * @param {((event: Events[Name]) => void) | EventListenerObject | null} listener
     * @param {AddEventListenerOptions | boolean} [options]
     * @override
     */
    addEventListener<Name extends keyof Events & string>(name: Name, listener: ((event: Events[Name]) => void) | EventListenerObject | null, options?: AddEventListenerOptions | boolean): void;
    /**
     * @template {keyof Events & string} Name
     * @param {Name} name
     * @param {Events[Name]["detail"]} detail
     * @protected
     */
    protected tell<Name extends keyof Events & string>(name: Name, detail: Events[Name]["detail"]): void;
}
