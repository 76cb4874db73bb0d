// Keeps the screen on while a video is looked at: nobody touches the phone meanwhile.

export class KeepAwake {
  /** @type {WakeLockSentinel | null} */
  #lock = null;
  #wanted = false;

  constructor() {
    // Browsers take it back while the page is away.
    document.addEventListener("visibilitychange", () => void this.#take());
  }

  /** @param {boolean} wanted */
  keep(wanted) {
    this.#wanted = wanted;
    if (wanted) void this.#take();
    else void this.#letGo();
  }

  async #take() {
    if (!this.#wanted || document.visibilityState === "hidden" || this.#lock?.released === false) return;
    // Refused where the battery is low; some browsers have none. The screen then goes off as it always does.
    const lock = (await navigator.wakeLock?.request("screen").catch(() => null)) ?? null;
    await this.#letGo();
    this.#lock = lock;
    if (!this.#wanted) await this.#letGo();
  }

  async #letGo() {
    const lock = this.#lock;
    this.#lock = null;
    await lock?.release().catch(() => undefined);
  }
}
